"""Subcommands of `sightfield harvest`."""
