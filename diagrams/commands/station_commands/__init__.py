"""The subcommands of `sightfield station`."""
