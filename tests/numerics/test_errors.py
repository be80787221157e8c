"""What is refused is told in one line; what is not is not looked at twice."""

import pytest

from sightfield.systems.numerics.errors import InvalidInput, require_type


class Speechless:
    """Puts itself in words at a cost that nobody should pay for what is accepted."""

    def __repr__(self):
        raise AssertionError("nobody has to know")


def test_what_is_of_the_right_type_is_not_put_in_words():
    require_type("world", Speechless(), int, Speechless)


def test_what_is_of_another_type_is_named_in_one_short_line():
    with pytest.raises(InvalidInput, match=r"^`world` must be of type int or str; got ") as refused:
        require_type("world", ["a\nb"] * 100, int, str)
    said = str(refused.value).partition("; got ")[2]
    assert said.startswith(r"list: ['a\nb', ")
    assert "\n" not in said
    assert len(said) <= len("list: ") + 80
