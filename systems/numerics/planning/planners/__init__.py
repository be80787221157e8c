"""Planners that put tables, programmes and extremals together."""
