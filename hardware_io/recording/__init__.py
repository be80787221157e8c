"""Runs, written down as they happen, and read back to be played again."""
