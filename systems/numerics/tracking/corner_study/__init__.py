"""The corner game solved and played numerically: what the closed forms are checked against."""
