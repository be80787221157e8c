"""Harvest scenarios that come with the package."""
