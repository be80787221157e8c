"""A cart among walls: sweeps that reach close to them, and paths that keep clear of them."""
