"""What a cart covers, where it may stand, and how near walls are: below all planners."""
