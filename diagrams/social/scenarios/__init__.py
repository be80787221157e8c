"""Scenarios of the social story that come with the package."""
