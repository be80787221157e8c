"""The search in Meshcat: the maze, who sees what, the friend graph, the newest pictures."""
