"""Compare the fast classification of table rows with regular expressions, for every short text."""

from __future__ import annotations

import re
from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.lint.shapes import MARKERS, ROWS, VECTORS, RowLayout, compute_shapes

NUMBER = re.compile(rb"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


def told(cell: bytes) -> bytes:
    return b"".join(b"0" if NUMBER.fullmatch(word) else b"!" for word in cell.split(b" ") if word)


def expected(line: bytes, layout: RowLayout) -> bytes:
    if layout is MARKERS:
        return b"\t".join(map(told, line.split(b"\t")))
    if layout is VECTORS:
        return b"\t".join(
            b",".join(told(part) or b"!" for part in cell.split(b",")) for cell in line.split(b"\t")
        )
    return b"".join(map(told, line.replace(b"\t", b" ").split(b" ")))


LONGER = {ROWS: r"^\.", VECTORS: r"^\.|,\.|\t ", MARKERS: r"^[. ]| \.|\d[eE]"}
"""Pattern of valid lines, by layout, that the fast classification passes on to the slow check."""
VALID = {ROWS: rb"0*", VECTORS: rb"0(,0)*(\t0(,0)*)*", MARKERS: rb"0?(\t0?)*"}
"""Pattern of the shapes of valid rows, by layout."""


def check(line: bytes, look: bytes, layout: RowLayout) -> None:
    wanted = expected(line, layout)
    if b"!" in wanted:
        assert b"!" in look or not re.fullmatch(VALID[layout], look)
    else:
        assert look == wanted or (b"!" in look and re.search(LONGER[layout].encode(), line))


@pytest.mark.parametrize("layout", [ROWS, VECTORS, MARKERS], ids=["rows", "vectors", "markers"])
def test_every_short_line_is_told_right(layout):
    for size in range(1, 5):
        lines = [bytes(characters) for characters in product(b"05.-e \t,x", repeat=size)]
        looks = compute_shapes(b"\n".join([b"", *lines, b""]), layout)[0].split(b"\n")
        for line, look in zip(lines, looks[1:-1], strict=True):
            check(line, look, layout)


@given(st.lists(st.text("0579.+-eE \t,xN\xff", max_size=12), min_size=1, max_size=8))
def test_lines_are_told_each_for_itself(lines):
    block = [line.encode("latin-1") for line in lines]
    for layout in (ROWS, VECTORS, MARKERS):
        looks = compute_shapes(b"\n".join([b"", *block, b""]), layout)[0].split(b"\n")
        for line, look in zip(block, looks[1:-1], strict=True):
            check(line, look, layout)


@given(
    st.lists(
        st.sampled_from(["0", "-0.0", "00.", "1", "-20.5", "0.001", ""]), min_size=1, max_size=9
    )
)
def test_a_zero_among_markers_is_not_missed(cells):
    zeros = any(cell and not cell.strip("-0.") for cell in cells)
    assert compute_shapes("\t".join([*cells, "\n"]).encode(), MARKERS)[1] == zeros
