"""Tests of finding the element, property or value at a cursor, also in damaged texts."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("pygls", reason="needs pygls (extra 'lsp')")

from hypothesis import given, settings
from hypothesis import strategies as st

from osimlite.cli.language_server.analysis import DocumentAnalysis
from osimlite.cli.language_server.completion import list_completions
from osimlite.cli.language_server.cursor import find_cursor
from osimlite.cli.language_server.findings import list_diagnostics
from osimlite.cli.language_server.hover import describe_cursor
from osimlite.cli.language_server.navigation import list_folding_ranges, list_symbols
from osimlite.cli.language_server.project import Project
from osimlite.cli.language_server.text import Text
from osimlite.errors import OsimliteError
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source
from tests.suite import choose

SETUPS = Path(__file__).resolve().parents[3] / "fixtures" / "setups"
WALKER = Path(__file__).resolve().parents[3] / "fixtures" / "walker" / "DynamicWalkerModel.osim"
TEXT = WALKER.read_text()


def test_every_object_is_known_from_the_tags_before_it() -> None:
    """Compare the class at each tag with the class of the object that the reader creates from the tag."""
    document = read_document(Source.from_text(TEXT))
    for item in document.model.walk():
        number = item.source_index
        if number is None:
            continue
        cursor = find_cursor(TEXT, document.source.spans[number].start + 1)
        assert cursor.kind == "tag" and cursor.element is not None
        assert (cursor.element.cls, cursor.element.number) == (type(item), number)


@pytest.mark.parametrize(
    ("before", "after", "kind", "word", "inner"),
    [
        ("<Model><BodySet><objects><Body name='a'><mass>1", "</mass>", "text", "1", "mass"),
        ("<Model><ForceSet><objects><Hunt", " name='a'>", "tag", "Hunt", "objects"),
        ("<Model><ForceSet></For", "ceSet>", "closing tag", "ForceSet", "ForceSet"),
        ("<Model><ForceSet><objects><PathSpring name='a", "b'>", "attribute", "ab", "objects"),
        ("<Model><a></b><BodySet>", "", "text", "", "BodySet"),
        ("<Model><!-- <BodySet", " -->", "comment", "", "Model"),
        ("<Model>\n<", "\n<BodySet/>", "tag", "", "Model"),
    ],
)
def test_broken_texts(before: str, after: str, kind: str, word: str, inner: str) -> None:
    cursor = find_cursor(before + after, len(before))
    assert (cursor.kind, cursor.word) == (kind, word)
    assert cursor.inner is not None and cursor.inner.tag == inner


def test_a_part_is_told_by_the_name_of_its_property() -> None:
    text = "<CustomJoint><SpatialTransform><TransformAxis name='rotation2'>"
    inner = find_cursor(text, len(text)).inner
    assert inner is not None and inner.spec is not None and inner.spec.tag == "rotation2"


@settings(max_examples=choose(15, 40))
@given(
    st.integers(0, len(TEXT)),
    st.integers(0, 60),
    st.sampled_from(["", "<", "</", "&", "-->", '"', "<Body", "é"]),
)
def test_no_question_about_a_damaged_text_fails(offset: int, cut: int, put: str) -> None:
    _ask("walker.osim", TEXT[:offset] + put + TEXT[offset + cut :], offset + len(put))


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(["ik.xml", "scale.xml", "id.xml", "loads.xml", "so.xml", "controls.xml", "grf.mot", "walk.trc"]),
    st.floats(0, 1), st.integers(0, 60), st.sampled_from(["", "<", "</", "&", "-->", '"', "<IKMarkerTask", "é", "\t"]),
)  # fmt: skip
def test_no_question_about_a_damaged_setup_or_table_fails(
    name: str, part: float, cut: int, put: str
) -> None:
    text = (SETUPS / name).read_text()
    offset = int(part * min(len(text), 2000))
    _ask(str(SETUPS / name), text[:offset] + put + text[offset + cut :], offset + len(put))


def _ask(file: str, text: str, place: int) -> None:
    analysis = DocumentAnalysis(Text(text), file)
    place = min(place, len(text))
    describe_cursor(analysis, place)
    list_completions(analysis, analysis if analysis.is_readable else None, place)
    list_diagnostics(analysis)
    list_symbols(analysis)
    list_folding_ranges(analysis)
    target = analysis.find_target(place)
    if target is not None:
        try:
            analysis.find_references(target)
            Project().find_location(target)
        except OsimliteError as error:  # pragma: no cover
            pytest.fail(str(error))
