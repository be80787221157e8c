"""Worlds drawn at random."""
