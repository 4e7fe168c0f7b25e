"""Tests of positions in a text as editors count them: lines, UTF-16 units, line ends."""

from __future__ import annotations

import pytest

pytest.importorskip("pygls", reason="needs pygls (extra 'lsp')")

from hypothesis import given
from hypothesis import strategies as st
from lsprotocol import types

from osimlite.cli.language_server.text import Text

CONTENT = st.text(alphabet=st.sampled_from("ab <>é\u2028\u0085\f😀\r\n"), max_size=40)
UNITS = st.sampled_from(list(types.PositionEncodingKind))


@given(CONTENT, UNITS, st.data())
def test_a_place_leads_back_to_its_offset(
    content: str, unit: types.PositionEncodingKind, data: st.DataObject
) -> None:
    text = Text(content, unit)
    offset = data.draw(st.integers(0, len(content)))
    result = text.offset(text.position(offset))
    # There is no position between the two characters of CR LF.
    assert result == offset or content[offset - 1 : offset + 1] == "\r\n"


@given(CONTENT, CONTENT, UNITS, st.data())
def test_a_change_is_the_same_as_a_cut(
    content: str, new: str, unit: types.PositionEncodingKind, data: st.DataObject
) -> None:
    text = Text(content, unit)
    start, end = sorted(data.draw(st.tuples(*[st.integers(0, len(content))] * 2)))
    place = text.range(start, end)
    start, end = text.offset(place.start), text.offset(place.end)
    changed = text.apply_change(types.TextDocumentContentChangePartial(place, new))
    assert changed.content == content[:start] + new + content[end:]


def test_units() -> None:
    content = "a😀é\nb"
    for unit, column in (("utf-8", 7), ("utf-16", 4), ("utf-32", 3)):
        text = Text(content, unit)
        assert text.position(3) == types.Position(0, column)
        assert text.offset(types.Position(0, column)) == 3
        assert text.offset(types.Position(0, 99)) == 3
        assert text.offset(types.Position(9, 0)) == len(content)


def test_a_whole_text_is_put_in_its_place() -> None:
    assert Text("a").apply_change(types.TextDocumentContentChangeWholeDocument("b")).content == "b"
