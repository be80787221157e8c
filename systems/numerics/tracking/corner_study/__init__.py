"""The corner game solved and played numerically, as a check of the closed forms."""
