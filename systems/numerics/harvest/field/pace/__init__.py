"""Pace: who has to wait for whom, and when everybody is where."""
