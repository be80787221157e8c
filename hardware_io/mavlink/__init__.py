"""Rovers that speak MAVLink, as ArduPilot does: the link to them, and a rover that stands in."""
