"""Statistics of times that may be cut off by a horizon: estimates, paired comparisons, seeds."""
