"""Crazyflies and what speaks their protocol, CRTP: the link, and one that stands in."""
