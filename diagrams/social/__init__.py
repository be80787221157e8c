"""The social story: scenario, diagram, run and pictures."""
