"""Driving a cart: what its driver remembers, does next, expects of others, and gives way to."""
