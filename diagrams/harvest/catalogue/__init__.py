"""Machines of makers, as YAML: see `makers`."""
