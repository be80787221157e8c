"""The subcommands of `sightfield standoff`."""
