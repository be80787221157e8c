"""Encode and decode messages in plain CDR, several times as fast as field by field.

The numbers between two strings always have the same layout, and are packed at once. The bytes are
the same as the library's, which still handles every other encoding.
"""

from collections.abc import Callable, Iterator
from functools import cache
from itertools import groupby
from operator import attrgetter
from struct import Struct, calcsize
from typing import Any, NamedTuple, TypeGuard, TypeVar

from cyclonedds.idl import IdlStruct

# Header of plain CDR, little-endian: two bytes of encoding, and two that are ignored.
_HEAD = b"\x00\x01\x00\x00"
_LENGTH = Struct("<I")
# Formats of `struct`, by the names of the library's types.
_FORMATS = {"float64": "d", "int32": "i", "uint32": "I"}

_Message = TypeVar("_Message", bound=IdlStruct)


class _Piece(NamedTuple):
    """Consecutive values that are packed at once.

    Attributes:
        numbers: How they are packed; None for one string.
        size: Size of each number, to which the piece is aligned [bytes].
        first, end: Range of the message's values that it holds.
        is_array: Whether the numbers are one value, a list.
    """

    numbers: Struct | None
    size: int
    first: int
    end: int
    is_array: bool


def plainly_encoded(kind: type[_Message]) -> type[_Message]:
    """A type of message whose fields are numbers, arrays of numbers, texts, and such messages.

    The type stays one of its own: a base class would be told to other participants as a base of the
    type, and Cyclone DDS 0.10 talks to none whose base has no fields.

    Args:
        kind: The type; its methods that encode and decode are replaced.
    """
    kind.serialize = _serialize
    kind.deserialize = classmethod(_deserialize)  # type: ignore[assignment]  # a method of the class
    return kind


def _serialize(
    self: IdlStruct, buffer: Any = None, endianness: Any = None, use_version_2: bool | None = None
) -> bytes:
    """The bytes of a message; `IdlStruct` packs those that are to be encoded otherwise."""
    if use_version_2 or buffer is not None or endianness is not None:
        return IdlStruct.serialize(self, buffer, endianness, use_version_2)
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


def _deserialize(
    cls: type[_Message], data: bytes, has_header: bool = True, use_version_2: bool | None = None
) -> _Message:
    """Decode a message, as `IdlStruct` does, which reads every other encoding."""
    if use_version_2 or not has_header or data[:2] != _HEAD[:2]:
        return IdlStruct.deserialize.__func__(cls, data, has_header, use_version_2)
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
    """Pieces of a type of message, and a function that returns all its values."""
    paths, forms = zip(*_leaves(kind), strict=True)

    def piece_of(k: int) -> tuple[int, int]:
        """Key of a piece: adjacent numbers of one size share it; an array or string has its own."""
        return (calcsize(forms[k][-1:]), -1 if len(forms[k]) == 1 else k)

    pieces = []
    for (size, _), group in groupby(range(len(forms)), key=piece_of):
        each = list(group)
        numbers = Struct("<" + "".join(forms[k] for k in each)) if size else None
        is_array = len(forms[each[0]]) > 1
        pieces.append(_Piece(numbers, size or _LENGTH.size, each[0], each[-1] + 1, is_array))
    return pieces, attrgetter(*paths)


def _leaves(kind: type, path: str = "") -> Iterator[tuple[str, str]]:
    """Attribute path of each value of a type of message, and its format; empty for a string."""
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
    """Type of each field that is a message; None for a field that is a value."""
    return [each if _is_message(each) else None for each in kind.__annotations__.values()]


def _is_message(annotation: Any) -> TypeGuard[type]:
    return isinstance(annotation, type) and issubclass(annotation, IdlStruct)
