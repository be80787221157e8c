"""The harvest story: combines work a field, carts carry the grain away."""
