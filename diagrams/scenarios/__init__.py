"""Built-in scenario files, shipped in the wheel."""
