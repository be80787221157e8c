"""The value function as the thesis computes it (3.15), to compare with."""
