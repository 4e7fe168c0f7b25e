"""Check line and column of every element."""

from __future__ import annotations

from pathlib import Path

from lxml import etree

from osimlite.io.document.source import Position, Source

TEXT = """<?xml version="1.0"?>
<!-- <Fake/> -->
<Root a='>' b="x/">
\t<One>a bb a</One><Two/>
\t<![CDATA[ <Not> ]]><Three>
\t</Three>
</Root>
"""


def test_elements_are_numbered_in_document_order() -> None:
    source = Source(TEXT.encode())
    assert [span.tag for span in source.spans] == ["Root", "One", "Two", "Three"]
    assert source.children(0) == [1, 2, 3]
    assert [source.children(number) for number in (1, 2, 3)] == [[], [], []]
    assert source.child(0, "Three") == 3


def test_positions() -> None:
    source = Source(TEXT.encode())
    assert source.locate_tag(0) == Position(3, 1, 5)
    assert source.locate_tag(1) == Position(4, 2, 4)
    assert source.locate_text(1, "bb") == Position(4, 9, 2)
    assert source.locate_text(1, "a", nth=1) == Position(4, 12, 1)
    assert source.locate_text(1) == Position(4, 7, 6)
    assert source.locate_text(2) == Position(4, 19, 4)
    assert source.locate_attribute(0, "b") == Position(3, 16, 2)
    assert source.locate_attribute(0, "c") == source.locate_tag(0)


def test_lines_end_in_any_way() -> None:
    source = Source(b"<a>\r\n<b/>\r<c/>\n<d/></a>")
    assert [source.locate_tag(n).line for n in range(4)] == [1, 2, 3, 4]
    assert len(source.lines) == 4


def test_columns_count_characters_not_bytes() -> None:
    assert Source("<a>é<b/></a>".encode()).locate_tag(1).column == 5


def test_bytes_that_are_not_utf8() -> None:
    source = Source(b'<?xml version="1.0" encoding="UTF-8"?>\n<a>1 \x96 2</a>')
    assert source.encoding == "cp1252"
    assert "\u2013" in source.text


def test_numbers_agree_with_lxml(fixtures: Path) -> None:
    source = Source.from_file(fixtures / "walker" / "DynamicWalkerModel.osim")
    root = etree.fromstring(source.text.replace("::", "__").encode())
    elements = list(root.iter(etree.Element))
    assert [span.tag.replace("::", "__") for span in source.spans] == [
        element.tag for element in elements
    ]
    lines: list[object] = [source.locate_tag(n).line for n in range(len(elements))]
    assert lines == [element.sourceline for element in elements]
    for span in source.spans:
        assert source.text[span.start] == "<"
        assert source.text[span.tag_end - 1] == ">"
        assert source.text[: span.end].endswith(">")
