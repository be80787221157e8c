"""Who tracks whom: rules that give each pursuer an evader, by name in `ASSIGNMENT_RULES`."""
