"""LeafSystems of the tracking story: agents, sight, assignment, pursuit, evasion."""
