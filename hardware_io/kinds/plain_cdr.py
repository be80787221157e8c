"""Messages of numbers and texts to plain CDR and back, several times as fast as field by field.

What lies between two texts always has the same form, and is packed at once. The bytes are those
that the library makes, which is left to do what is of another form.
"""

from collections.abc import Callable, Iterator
from functools import cache
from itertools import groupby
from operator import attrgetter
from struct import Struct, calcsize
from typing import Any, NamedTuple, Self, TypeGuard

from cyclonedds.idl import IdlStruct

# Of plain CDR, little-endian: two bytes that say so, and two of no account.
_HEAD = b"\x00\x01\x00\x00"
_LENGTH = Struct("<I")
# By the names of the library's types.
_FORMATS = {"float64": "d", "int32": "i", "uint32": "I"}


class _Piece(NamedTuple):
    """Values one after the other.

    Attributes:
        numbers: How they are packed; None: it is one text.
        size: Of each number: a multiple of it is where they begin [bytes].
        first, end: Which of the message's values they are.
        is_array: Whether they are one value, a list.
    """

    numbers: Struct | None
    size: int
    first: int
    end: int
    is_array: bool


class PlainMessage(IdlStruct):
    """A message whose fields are numbers, arrays of numbers, texts, and messages of such fields."""

    def serialize(
        self, buffer: Any = None, endianness: Any = None, use_version_2: bool | None = None
    ) -> bytes:
        """The bytes of a message.

        Args:
            buffer, endianness, use_version_2: As of `IdlStruct`, which packs it if one is given.
        """
        if use_version_2 or buffer is not None or endianness is not None:
            return super().serialize(buffer, endianness, use_version_2)
        pieces, values_of = _layout(type(self))
        values, data = values_of(self), bytearray(_HEAD)
        for numbers, size, first, end, is_array in pieces:
            data += b"\x00" * ((len(_HEAD) - len(data)) % size)
            if numbers is None:
                text = values[first].encode()
                data += _LENGTH.pack(len(text) + 1) + text + b"\x00"
            else:
                data += numbers.pack(*(values[first] if is_array else values[first:end]))
        return bytes(data)

    @classmethod
    def deserialize(
        cls, data: bytes, has_header: bool = True, use_version_2: bool | None = None
    ) -> Self:
        """The message of some bytes.

        Args:
            data: They.
            has_header, use_version_2: As of `IdlStruct`, which reads those that differ.
        """
        if use_version_2 or not has_header or data[:2] != _HEAD[:2]:
            return super().deserialize(data, has_header, use_version_2)
        at, values = len(_HEAD), list[Any]()
        for numbers, size, _, _, is_array in _layout(cls)[0]:
            at += (len(_HEAD) - at) % size
            if numbers is None:
                begin = at + _LENGTH.size
                at = begin + _LENGTH.unpack_from(data, at)[0]
                values.append(data[begin : at - 1].decode())
            else:
                found = numbers.unpack_from(data, at)
                at += numbers.size
                if is_array:
                    values.append(list(found))
                else:
                    values += found
        return _build(cls, iter(values))


@cache
def _layout(kind: type) -> tuple[list[_Piece], Callable[[Any], tuple[Any, ...]]]:
    """The pieces of a kind of message, and what gives all its values."""
    paths, forms = zip(*_leaves(kind), strict=True)

    def piece_of(k: int) -> tuple[int, int]:
        """Numbers of one size that follow each other are one piece; each other value is its own."""
        return (calcsize(forms[k][-1:]), -1 if len(forms[k]) == 1 else k)

    pieces = []
    for (size, _), group in groupby(range(len(forms)), key=piece_of):
        each = list(group)
        numbers = Struct("<" + "".join(forms[k] for k in each)) if size else None
        is_array = len(forms[each[0]]) > 1
        pieces.append(_Piece(numbers, size or _LENGTH.size, each[0], each[-1] + 1, is_array))
    return pieces, attrgetter(*paths)


def _leaves(kind: type, path: str = "") -> Iterator[tuple[str, str]]:
    """Where each value of a kind of message is, and how it is packed; empty: as a text."""
    for each, annotation in kind.__annotations__.items():
        if _is_message(annotation):
            yield from _leaves(annotation, f"{path}{each}.")
        elif annotation is str:
            yield path + each, ""
        else:
            (told,) = annotation.__metadata__
            if told in _FORMATS:
                yield path + each, _FORMATS[told]
            else:
                (of,) = told.subtype.__metadata__
                yield path + each, f"{told.length}{_FORMATS[of]}"


def _build(kind: type, values: Iterator[Any]) -> Any:
    return kind(*[_build(of, values) if of else next(values) for of in _parts(kind)])


@cache
def _parts(kind: type) -> list[type | None]:
    """Of each field: what kind of message it is; None: a value."""
    return [each if _is_message(each) else None for each in kind.__annotations__.values()]


def _is_message(annotation: Any) -> TypeGuard[type]:
    return isinstance(annotation, type) and issubclass(annotation, IdlStruct)
