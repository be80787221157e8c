"""The game of one pursuer that keeps one evader in sight on a map, solved on grids."""
