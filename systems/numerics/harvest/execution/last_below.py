"""The last of ordered values that is not above one, in compiled functions."""

from ...compiled import kernel


@kernel
def last_below(values, low, high, value):
    """Number of the last of some values that is not above a value, low - 1 for none.

    Args:
        values: Never decreasing from low to high, shape (n,).
        low, high: The first number, and one after the last.
        value: In the units of the values.
    """
    while low < high:
        middle = (low + high) // 2
        if values[middle] <= value:
            low = middle + 1
        else:
            high = middle
    return low - 1
