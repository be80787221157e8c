"""Evaders that know the pursuers' rule, and choose the best response to it."""
