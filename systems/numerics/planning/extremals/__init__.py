"""Extremals of the tractor-trailer: arcs in closed form, primitives, and the time-optimal word."""
