"""The omni-directional camera, what it sees, and what is estimated from its pictures."""
