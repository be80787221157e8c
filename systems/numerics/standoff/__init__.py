"""Keeping a distance by an estimate whose error grows with the square of that distance."""
