"""The colours of combines, the same in plots and in the scene."""

# Thesis, Figure 3.5: red, green, blue; then whatever tells apart. Names of Matplotlib.
COLOURS = ("tab:red", "tab:green", "tab:blue", "tab:orange", "tab:purple", "tab:brown")


def combine_colour(combine: int) -> str:
    """Name of a combine's colour."""
    return COLOURS[combine % len(COLOURS)]
