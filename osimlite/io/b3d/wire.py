"""Decoder of Protocol Buffers messages, for the few types that .b3d files use.

The encoding is described at https://protobuf.dev/programming-guides/encoding. A message is a sequence
of fields; each begins with a varint that holds the field's number and the type of what follows. A
schema says which numbers are known and what they mean; unknown numbers are skipped, as the encoding
demands.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from typing import Any

from osimlite.base.named_tuples import NamedTuple

VARINT = 0
"""Wire type of integers of variable length."""

FIXED64 = 1
"""Wire type of numbers of 8 bytes."""

BYTES = 2
"""Wire type of fields with a length: texts, messages, packed numbers."""

FIXED32 = 5
"""Wire type of numbers of 4 bytes."""

MAX_VARINT_BYTES = 10
"""Number of bytes of the longest varint, which holds 64 bits."""


class DamagedMessageError(ValueError):
    """Error for bytes that are not a message of the expected kind."""


class WireField(NamedTuple):
    """Field of a message as it is encoded.

    Attributes:
        number: number of the field.
        wire_type: type of the encoding in Protocol Buffers (0 varint, 1 eight bytes, 2 with length,
            5 four bytes).
        value: integer of a varint, or bytes of another value.
        offset: offset of the value in the message.
    """

    number: int
    wire_type: int
    value: int | memoryview
    offset: int


def split_message(data: memoryview) -> Iterator[WireField]:
    """Yield the fields of a message in their order.

    Raises:
        DamagedMessageError: the bytes are not a message.
    """
    position = 0
    size = len(data)
    while position < size:
        tag, position = _read_varint(data, position)
        # A tag has the number of the field and, in three bits, its type.
        number = tag >> 3
        wire_type = tag & 7
        # Field numbers begin at 1.
        if not number:
            raise DamagedMessageError("a field has the number 0")
        if wire_type == VARINT:
            start = position
            value, position = _read_varint(data, position)
            yield WireField(number, wire_type, value, start)
            continue
        if wire_type == BYTES:
            length, position = _read_varint(data, position)
        elif wire_type == FIXED64:
            length = 8
        elif wire_type == FIXED32:
            length = 4
        else:
            raise DamagedMessageError(f"field {number} has the unknown wire type {wire_type}")
        if length > size - position:
            raise DamagedMessageError(f"field {number} is longer than its message")
        yield WireField(number, wire_type, data[position : position + length], position)
        position += length


def _read_varint(data: memoryview, position: int) -> tuple[int, int]:
    """Return a varint and the position after it.

    Raises:
        DamagedMessageError: the message ends within the number, or the number has more than 64
            bits.
    """
    result = 0
    for index in range(MAX_VARINT_BYTES):
        if position + index >= len(data):
            raise DamagedMessageError("the message ends within a number")
        byte = data[position + index]
        # Seven bits a byte, the lowest first; the eighth says that more follow.
        result |= (byte & 0x7F) << (7 * index)
        if byte < 0x80:
            # Nimble writes negative integers as 64 bits.
            return result & 0xFFFF_FFFF_FFFF_FFFF, position + index + 1
    raise DamagedMessageError("a number has more than 64 bits")


class Field(NamedTuple):
    """Declaration of a field.

    Attributes:
        name: name of the value in the result.
        type: ``int``, ``bool``, ``float`` (32 bits), ``double``, ``text``, or the schema of a
            message.
        repeated: whether the value is a tuple.
    """

    name: str
    type: str | Schema
    repeated: bool = False


Schema = Mapping[int, Field]
"""Declaration of a message: the fields by their numbers."""

_DEFAULTS: dict[str, Any] = {"int": 0, "bool": False, "float": 0.0, "double": 0.0, "text": ""}
"""Values of absent fields; a message writes no field that has them."""

_FORMATS = {"float": ("<f", FIXED32, 4), "double": ("<d", FIXED64, 8)}
"""Format of `struct`, wire type and number of bytes of each type with a fixed size."""


def decode_message(data: memoryview, schema: Schema) -> dict[str, Any]:
    """Decode a message.

    Args:
        data: bytes of the message.
        schema: declaration of the message.

    Returns:
        Values by name: numbers, texts and dictionaries, in tuples where repeated. An absent field
        has its default.

    Raises:
        DamagedMessageError: the bytes are not a message of this schema.
    """
    result: dict[str, Any] = {}
    repeated: dict[str, list[Any]] = {}
    for name, kind, is_repeated in schema.values():
        if is_repeated:
            # Absent fields have their defaults, nested messages those of their fields.
            repeated[name] = []
        else:
            result[name] = (
                _DEFAULTS[kind] if isinstance(kind, str) else decode_message(data[:0], kind)
            )
    for field in split_message(data):
        declared = schema.get(field.number)
        # Fields of later versions are passed over.
        if declared is None:
            continue
        values = _decode_values(field, declared)
        if declared.repeated:
            repeated[declared.name] += values
        elif len(values) == 1:
            # By the encoding, the last of several values of a field counts.
            result[declared.name] = values[0]
        else:
            raise DamagedMessageError(f"'{declared.name}' has {len(values)} values instead of one")
    return result | {name: tuple(values) for name, values in repeated.items()}


def _decode_values(field: WireField, declared: Field) -> list[Any]:
    """Return the values of a field; numbers may be packed, several in one field.

    Raises:
        DamagedMessageError: the field has another wire type than its declared type, a number is cut
            off, or a text is not UTF-8.
    """
    kind, value = declared.type, field.value
    if kind in ("int", "bool"):
        if isinstance(value, int):
            return [_convert_integer(value, kind)]
        # Packed: several varints in one field.
        if field.wire_type == BYTES and declared.repeated:
            result = []
            position = 0
            while position < len(value):
                number, position = _read_varint(value, position)
                result.append(_convert_integer(number, kind))
            return result
    elif isinstance(kind, str) and kind in _FORMATS:
        form, wire_type, size = _FORMATS[kind]
        is_packed = field.wire_type == BYTES and declared.repeated
        if isinstance(value, memoryview) and (is_packed or field.wire_type == wire_type):
            if len(value) % size:
                raise DamagedMessageError(f"'{declared.name}' ends within a number")
            return [number for (number,) in struct.iter_unpack(form, value)]
    elif field.wire_type == BYTES and isinstance(value, memoryview):
        if isinstance(kind, str):
            try:
                return [str(value, "utf-8")]
            except UnicodeDecodeError:
                raise DamagedMessageError(f"'{declared.name}' is not text in UTF-8") from None
        return [decode_message(value, kind)]
    expected = kind if isinstance(kind, str) else "message"
    raise DamagedMessageError(
        f"'{declared.name}' (field {field.number}) has wire type {field.wire_type}, which holds no "
        f"{expected}"
    )


def _convert_integer(value: int, kind: str | Schema) -> int | bool:
    """Return a varint as a truth value or as a signed integer of 32 bits.

    A negative integer has 64 bits in the file.
    """
    if kind == "bool":
        return bool(value)
    # Two's complement of 32 bits.
    value &= 0xFFFF_FFFF
    return value - (1 << 32) if value >= 1 << 31 else value
