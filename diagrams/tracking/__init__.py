"""The tracking story: scenario, diagram, run and pictures."""
