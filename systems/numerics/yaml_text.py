"""YAML whose every fault is one kind of error."""

from typing import Any

import yaml


def read_yaml(text: str) -> Any:
    """What a text in YAML says: mappings, lists, words, numbers.

    PyYAML reports its own faults as such, but lets through what readers of numbers and dates raise,
    and what comes of a thousand brackets.

    Args:
        text: All of it.

    Raises:
        yaml.YAMLError: It is none, a number or date in it is none, or it is nested too deep.
    """
    try:
        return yaml.safe_load(text)
    except (ValueError, KeyError, AttributeError) as error:
        raise yaml.YAMLError(f"a number, date or truth value is none: {error}") from None
    except RecursionError:
        raise yaml.YAMLError("nested too deep") from None
