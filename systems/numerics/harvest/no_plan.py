"""What is raised where a harvest that could be asked for has no plan."""

from ..errors import InvalidInput


class NoPlan(InvalidInput):
    """Every value is in its range, yet no plan was found for such machines on such a field."""
