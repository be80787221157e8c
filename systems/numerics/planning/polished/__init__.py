"""Paths of least time at once: a table says where to look, a programme finds the optimum."""
