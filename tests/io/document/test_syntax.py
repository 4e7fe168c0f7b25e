"""Check messages of syntax errors in plain words, each at the wrong character."""

from __future__ import annotations

import pytest

from osimlite.errors import NotWellFormedError
from osimlite.io.document.reader import read_text

HEAD = '<OpenSimDocument Version="40600">\n'


@pytest.mark.parametrize(
    ("text", "at", "words"),
    [
        (
            HEAD + "<Model>\n  <mass>8</mas>\n</Model></OpenSimDocument>",
            "</mas>",
            "<mass> of line 3 is not closed",
        ),
        (
            HEAD + "<Model>\n  <mass>é ü</mas>\n</Model></OpenSimDocument>",
            "</mas>",
            "is not closed before </mas>",
        ),
        (
            HEAD + "<Model>\n<H::P>8</H::Q>\n</Model></OpenSimDocument>",
            "</H::Q>",
            "<H::P> of line 3",
        ),
        (
            HEAD + "<Model>\n<H::P><H::P>8 < 9</H::P>\n</Model></OpenSimDocument>",
            " 9</H",
            "write &lt;",
        ),
        (HEAD + "<Model>\n  <Body></Body\n  </Model>", "</Model>", "expected '>'"),
        (HEAD + "<Model>\n  <Body>", ">", "before <Body> of line 3 is closed"),
        (
            HEAD + "<Model>\n  <Body name=a'/></Model></OpenSimDocument>",
            "a'/>",
            "must be in quotes",
        ),
        (HEAD + "<Model/></OpenSimDocument>\n\n<Model/>", "<Model/>", "after the root element"),
    ],
)
def test_the_place_is_the_character_that_is_wrong(text, at, words):
    with pytest.raises(NotWellFormedError) as caught:
        read_text(text)
    offset = text.rindex(at)
    line = text.count("\n", 0, offset) + 1
    assert (caught.value.line, caught.value.column) == (
        line,
        offset - text.rfind("\n", 0, offset),
    ), str(caught.value)
    assert words in caught.value.message
