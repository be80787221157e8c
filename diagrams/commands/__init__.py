"""The `sightfield` command line, a file for each command."""
