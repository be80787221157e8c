"""Which combine a cart serves next."""
