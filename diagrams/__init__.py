"""Scenarios, diagrams, visuals and the command line."""
