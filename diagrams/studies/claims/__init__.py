"""What 2.2.7 says of its figures, each claim as a statistical test with its verdict."""
