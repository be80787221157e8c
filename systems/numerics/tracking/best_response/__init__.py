"""Evaders that know the pursuers' rule, and answer it."""
