"""Tracking through a social network: the network, its pictures, and what they show."""
