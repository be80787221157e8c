"""Subcommands of `sightfield camera`."""
