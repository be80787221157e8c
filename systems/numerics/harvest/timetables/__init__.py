"""Timetables for the work that combines really do on a field, with its corners and waits."""
