"""Compare the fast computation of element positions with reading the text tag by tag."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.io.document.parsing import parse_source
from osimlite.io.document.source import Source
from osimlite.io.document.spans import PlainSpans, Span, find_markup, find_spans

PIECES = [
    "<a>",
    "</a>",
    "<a b='>'>",
    "<a/>",
    '<b c=">"/>',
    "<b>",
    "</b >",
    "<!-- <a> -->",
    "<!-- x -->",
    "<",
    ">",
    "/",
]
PIECES += [
    "<![CDATA[<a>]]>",
    "<?x <a>?>",
    '"',
    "'",
    "text",
    " ",
    "\n",
    "<a\tb='1'\n>",
    "<:: >",
    "<a&b>",
]
TAG = st.sampled_from(["a", "ab", "a.b", "a-c"])
ATTRIBUTES = st.sampled_from(["", " x='>'", ' x="/>"', "\n x = '1'", ' x="a" y="/"'])
# Comments, CDATA sections and processing instructions, in which tags do not count.
HIDING = [
    "<!-- remark -->",
    "<!-- </a> -->",
    "<![CDATA[</ab>]]>",
    "<?pi </a>?>",
    "<!-- <a> -->",
    "<!-- ? [ ! -->",
]
HIDING += ["<!-- <![CDATA[ ]]> </a> -->", "<![CDATA[<!-- --> </a>]]>", "<?pi <!-- --> </a>?>"]
TEXT = st.sampled_from(["", " ", "1 2", "a > b", "![", "!? [", *HIDING])
TREE: st.SearchStrategy[str] = st.recursive(
    st.one_of(st.builds("<{}{}/>".format, TAG, ATTRIBUTES), TEXT),
    lambda inner: st.builds(
        lambda tag, attributes, content, end: f"<{tag}{attributes}>{''.join(content)}</{tag}{end}>",
        TAG, ATTRIBUTES, st.lists(inner, max_size=4), st.sampled_from(["", " "]),
    ),
    max_leaves=20,
)  # fmt: skip


def one_by_one(text: str) -> list[Span]:
    spans: list[Span] = []
    above: list[int] = []
    for kind, start, end, tag in find_markup(text):
        if kind in ("open", "empty"):
            spans.append(Span(tag, start, end, end, end))
            if kind == "open":
                above.append(len(spans) - 1)
        elif kind == "close" and above:
            number = above.pop()
            spans[number] = spans[number]._replace(inner_end=start, end=end)
    return spans


@given(st.lists(st.sampled_from(PIECES), max_size=30).map("".join))
def test_one_search_through_a_text_finds_what_its_markup_says(text: str) -> None:
    assert find_spans(text) == one_by_one(text)


@given(st.builds("<?xml version='1.0'?>\n<root>{}</root>".format, TREE))
def test_a_well_formed_text_is_read_in_parts(text: str) -> None:
    source = Source(text.encode())
    parse_source(source)
    assert list(source.spans) == one_by_one(text)
    assert isinstance(source.spans, PlainSpans)
    inside = [number for number, span in enumerate(source.spans) if span.start > 0]
    children = [child for number in range(len(source.spans)) for child in source.children(number)]
    assert sorted(children) == inside[1:]


@pytest.mark.parametrize(
    "text",
    [
        "<a><!-- <b/> --><c/></a>",
        "<a><!-- </a> <b> --><c><c/><!-- </c> --></c></a>",
        "<a><![CDATA[<b></a>]]><c><![CDATA[</c>]]></c></a>",
        "<?note <b?><a><?note </a?><c/></a><!-- <d/> -->",
    ],
)
def test_what_looks_like_an_element_in_a_comment_or_its_like_is_none(text: str) -> None:
    source = Source(text.encode())
    parse_source(source)
    assert isinstance(source.spans, PlainSpans)
    assert list(source.spans) == one_by_one(text)
    assert [span.tag for span in source.spans if span.tag in "bd"] == []


@pytest.mark.parametrize(
    "text", ["<a><a><b/></a ></a>", "<a><b/><a><b/></a\n></a>", "<a><b/><ab></ab></a >"]
)
def test_an_end_may_have_a_blank(text: str) -> None:
    source = Source(text.encode())
    parse_source(source)
    assert isinstance(source.spans, PlainSpans)
    assert list(source.spans) == one_by_one(text)


def test_the_walker_is_read_in_parts(fixtures: Path) -> None:
    source = Source.from_file(fixtures / "walker" / "DynamicWalkerModel.osim")
    parse_source(source)
    assert isinstance(source.spans, PlainSpans)
    assert source.spans[:2] == one_by_one(source.text)[:2]
    assert list(source.spans) == find_spans(source.text)


@pytest.mark.parametrize("behind", ["", "\n", "<!-- </a> -->", "<!-- </a>\n-->\n", "<?end </a>?>"])
@pytest.mark.parametrize("close", ["</a>", "</a >"])
def test_the_root_ends_where_it_does_whatever_is_behind_it(close: str, behind: str) -> None:
    text = f"<a><b>1</b><!-- </a> -->{close}{behind}"
    assert list(PlainSpans(text, 2)) == find_spans(text)
