"""The `sightfield` command line, one command to a file."""
