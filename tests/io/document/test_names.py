"""Check colons in names and namespaces, which OpenSim treats as ordinary letters and attributes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

import osimlite
from osimlite.io.document.names import decode_name, replace_colons
from osimlite.io.document.reader import Document, read_document
from osimlite.io.document.source import Source

HEAD = '<OpenSimDocument Version="40600"'
REST = "<BodySet><objects><Body name='b'><mass>2</mass></Body></objects></BodySet></Model></OpenSimDocument>"


def read(text: str) -> Document:
    return read_document(Source(text.encode()))


@pytest.mark.parametrize(
    "head",
    [
        f'{HEAD} xmlns="http://x.org"><Model>',
        f'{HEAD}\n\txmlns = "http://x.org" xmlns:x="y"><Model>',
        f'{HEAD} xmlns="no address">\n<Model>',
        f'{HEAD} xmlns:o=""><Model xmlns="a">',
        f'{HEAD} xmlns:xml="http://q"><Model>',
        f"{HEAD} xmlns:xsi='http://www.w3.org/2001/XMLSchema-instance' xsi:schemaLocation='a b'><Model>",
    ],
)
def test_a_namespace_changes_no_element(head: str) -> None:
    assert read(head + REST).model["/bodyset/b"].mass == 2


def test_namespaces_inside_a_model_are_attributes_that_stay() -> None:
    text = f'{HEAD}><Model xmlns="a" xml:space="preserve" o:id="3">{REST}'
    result = read(text)
    assert [note.word for note in result.notes] == ["xmlns", "xml:space", "o:id"]
    written = osimlite.to_text(result.model)
    assert '<Model xmlns="a" xml:space="preserve" o:id="3">' in written
    assert osimlite.read_text(written) == result.model


@pytest.mark.parametrize("tag", ["o:mass", "mass:", "a:b:c", "OpenSim::mass", "xml:mass"])
def test_a_name_with_a_colon_is_another_name(tag: str) -> None:
    result = read(
        f"{HEAD} xmlns:o='u'><Model>{REST}".replace(
            "<mass>2</mass>", f"<mass>2</mass><{tag} o:a='1'>3</{tag}>"
        )
    )
    assert [(note.kind, note.word) for note in result.notes] == [("unknown-tag", tag)]
    written = osimlite.to_text(result.model)
    assert f'<{tag} o:a="1">3</{tag}>' in written
    assert osimlite.read_text(written) == result.model


def test_what_is_no_name_keeps_its_colons() -> None:
    inside = (
        "<Body name='a:b'><x><![CDATA[<o:p xmlns='q'>]]></x></Body><!-- <o:p xmlns='q'> a:b -->"
    )
    result = read(
        f"{HEAD}><Model><BodySet><objects>{inside}</objects></BodySet></Model></OpenSimDocument>"
    )
    assert result.model.body_set.objects[0].name == "a:b"
    written = osimlite.to_text(result.model)
    assert "&lt;o:p xmlns='q'&gt;" in written
    assert "<!-- <o:p xmlns='q'> a:b -->" in written


PIECES = [
    "<a",
    "<a:b",
    " xmlns='u'",
    " x:y='1'",
    ' z="p:q"',
    ">",
    "/>",
    "</a:b>",
    "</a>",
    "t:",
    "\n",
]
PIECES += ["<!-- <a:b> -->", "<![CDATA[<a:b>]]>"]


@given(st.lists(st.sampled_from(PIECES), max_size=12))
def test_no_namespace_is_left_and_no_place_moves(pieces: list[str]) -> None:
    text = "".join(pieces)
    parsed = replace_colons(text.encode()).decode()
    assert len(parsed) == len(text)
    assert decode_name(parsed) == text
    try:
        root = etree.fromstring(parsed.encode())
    except etree.XMLSyntaxError:
        return
    for element in root.iter(etree.Element):
        assert not element.nsmap
        assert "{" not in element.tag
        assert not any("{" in key for key in element.attrib)
