"""Frames of .b3d files as arrays.

All frames of a kind have one size, and every number in them has a fixed width. So the layout of the
first frame of a block is that of all others, unless the file is damaged; this is checked for each
frame, and frames are taken apart one by one only where the check fails.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from osimlite.base.text import format_count
from osimlite.io.b3d.wire import BYTES, FIXED64, DamagedMessageError, split_message
from osimlite.mechanics.multibody.spatial import Array

NUMBER_BYTES = 8
"""Size of a number of 64 bits."""

Layout = dict[int, tuple[int, int]]
"""Offset and number of bytes of each field in a frame, by the number of the field."""


def decode_frames(
    rows: np.ndarray[Any, np.dtype[np.uint8]], names: Mapping[int, str]
) -> dict[str, Array]:
    """Decode frames of one size.

    Args:
        rows: bytes of n frames (n, size).
        names: names of the known fields by their numbers.

    Returns:
        Numbers of each field (n, m) by name. A field that the frames do not have is left out.

    Raises:
        DamagedMessageError: a frame is not a message, or has other fields than the first one.
    """
    if not len(rows):
        return {}
    # The layout of the first frame is taken for all.
    layout = _find_layout(memoryview(rows[0].tobytes()))
    is_number = np.zeros(rows.shape[1], dtype=bool)
    for offset, size in layout.values():
        is_number[offset : offset + size] = True
    # The bytes between the numbers, tags and lengths, must be equal in all frames.
    structure = rows[:, ~is_number]
    differing = np.flatnonzero((structure != structure[0]).any(axis=1))
    result = {}
    for number, (offset, size) in layout.items():
        if number in names and size:
            # Protocol Buffers are little-endian.
            numbers = np.ascontiguousarray(rows[:, offset : offset + size]).view("<f8")
            result[names[number]] = numbers.astype(float)
    for index in differing:
        # A frame whose bytes differ may have its fields in another order.
        _replace_row(result, int(index), rows[index], layout, names)
    return result


def _find_layout(frame: memoryview) -> Layout:
    """Return where the numbers of each field are in the bytes of a frame.

    Raises:
        DamagedMessageError: a field does not hold numbers of 64 bits, or occurs twice.
    """
    layout: Layout = {}
    for field in split_message(frame):
        if not isinstance(field.value, memoryview) or field.wire_type not in (BYTES, FIXED64):
            raise DamagedMessageError(
                f"field {field.number} of a frame has wire type {field.wire_type}; expected "
                f"numbers of 64 bits (wire type {FIXED64}) or a list of them ({BYTES})"
            )
        if field.number in layout:
            raise DamagedMessageError(
                f"field {field.number} occurs twice in a frame; expected it once"
            )
        if len(field.value) % NUMBER_BYTES:
            raise DamagedMessageError(
                f"field {field.number} of a frame has {format_count(len(field.value), 'byte')}, which is no "
                f"multiple of {NUMBER_BYTES}"
            )
        layout[field.number] = (field.offset, len(field.value))
    return layout


def _replace_row(
    result: dict[str, Array],
    index: int,
    row: np.ndarray[Any, np.dtype[np.uint8]],
    layout: Layout,
    names: Mapping[int, str],
) -> None:
    """Decode a frame whose fields are in other places than those of the first frame.

    Raises:
        DamagedMessageError: the row is not a message, or has other fields than the first frame.
    """
    text = row.tobytes()
    row_layout = _find_layout(memoryview(text))
    if {number: size for number, (_, size) in row_layout.items()} != {
        number: size for number, (_, size) in layout.items()
    }:
        raise DamagedMessageError(f"frame {index} has other fields than the first one")
    for number, (offset, size) in row_layout.items():
        if number in names and size:
            result[names[number]][index] = np.frombuffer(text[offset : offset + size], "<f8")
