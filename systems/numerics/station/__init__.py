"""What a laboratory does to numbers on their way: late, lost, rounded, stale."""
