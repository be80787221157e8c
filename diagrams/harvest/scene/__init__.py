"""The harvest in Meshcat: the field turns from crop to stubble, tanks fill, carts carry."""
