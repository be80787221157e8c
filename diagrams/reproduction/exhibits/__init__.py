"""The exhibits, one file for each figure or table, or for those that belong together."""
