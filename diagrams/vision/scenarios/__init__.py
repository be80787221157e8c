"""Scenarios of `sightfield camera track` that come with the package."""
