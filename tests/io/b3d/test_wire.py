"""Check decoding of the Protocol Buffers types in .b3d files, and clear errors for all other types."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from osimlite.io.b3d.wire import DamagedMessageError, Field, decode_message, split_message
from tests.io.b3d_files import encode_bytes, encode_message, encode_varint
from tests.suite import choose

SCHEMA = {
    1: Field("count", "int"),
    2: Field("numbers", "double", True),
    3: Field("text", "text"),
    4: Field("flags", "bool", True),
    5: Field("parts", {1: Field("size", "int"), 2: Field("rate", "float")}, True),
    6: Field("names", "text", True),
    7: Field("codes", "int", True),
}
INTS = st.integers(-(2**31), 2**31 - 1)
MESSAGES = st.fixed_dictionaries(
    {
        "count": INTS,
        "numbers": st.lists(st.floats(allow_nan=False)).map(tuple),
        "text": st.text(),
        "flags": st.lists(st.booleans()).map(tuple),
        "parts": st.lists(
            st.fixed_dictionaries({"size": INTS, "rate": st.floats(allow_nan=False, width=32)})
        ).map(tuple),
        "names": st.lists(st.text()).map(tuple),
        "codes": st.lists(INTS).map(tuple),
    }
)


@settings(max_examples=choose(15, 100))
@given(MESSAGES)
def test_what_is_encoded_is_decoded(values: dict[str, object]) -> None:
    assert decode_message(memoryview(encode_message(values, SCHEMA)), SCHEMA) == values


@given(st.binary(max_size=60))
def test_any_bytes_are_decoded_or_refused(data: bytes) -> None:
    try:
        decode_message(memoryview(data), SCHEMA)
    except DamagedMessageError as error:
        assert str(error)


def test_unknown_fields_are_skipped_and_the_last_value_counts() -> None:
    data = b"\x08\x01" + encode_bytes(99, b"x") + b"\x08\x02"
    assert decode_message(memoryview(data), SCHEMA)["count"] == 2


def test_unpacked_numbers_are_numbers_too() -> None:
    assert decode_message(memoryview(b"\x38\x05\x38\x06"), SCHEMA)["codes"] == (5, 6)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"\x08", "ends within a number"),
        (b"\x00\x00", "the number 0"),
        (b"\x0b", "unknown wire type 3"),
        (b"\x08" + b"\xff" * 11, "more than 64 bits"),
        (b"\x1a\x05ab", "longer than its message"),
        (b"\x1a\x01\xff", "not text in UTF-8"),
        (b"\x0a\x01a", "'count' .field 1. has wire type 2, which holds no int"),
        (b"\x12\x03abc", "'numbers' ends within a number"),
        (
            encode_varint(1 << 3 | 1) + b"\0" * 8,
            "'count' .field 1. has wire type 1, which holds no int",
        ),
    ],
)
def test_damage_is_described(data: bytes, message: str) -> None:
    with pytest.raises(DamagedMessageError, match=message):
        decode_message(memoryview(data), SCHEMA)


def test_offsets_are_those_of_values() -> None:
    data = b"\x08\x01" + encode_bytes(3, b"abc")
    assert [(each.number, each.offset) for each in split_message(memoryview(data))] == [
        (1, 1),
        (3, 4),
    ]
