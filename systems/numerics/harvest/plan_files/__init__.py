"""Plans as files that other programs and farm machines read."""
