"""Check formatting of documents of every version: one layout, with unchanged content."""

from __future__ import annotations

import pytest

from osimlite.errors import DocumentError
from osimlite.io.document.printer import format_document
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source

DOCUMENT = '<OpenSimDocument Version="{}"><Model name="m">{}</Model></OpenSimDocument>'


def laid_out(inner: str, version: int = 30000) -> str:
    """Return the formatted lines between the tags of the model."""
    text = format_document(Source(DOCUMENT.format(version, inner).encode()))
    assert format_document(Source(text.encode())) == text
    assert f'<OpenSimDocument Version="{version}">\n\t<Model name="m">' in text
    assert text.startswith('<?xml version="1.0" encoding="UTF-8" ?>\n') and text.endswith(
        "</OpenSimDocument>\n"
    )
    return (
        text[text.index('name="m">') + 9 : text.rindex("</Model>")].replace("\n\t\t", "\n").strip()
    )


@pytest.mark.parametrize(
    ("inner", "expected"),
    [
        ("<gravity>\n 0\t-9.80665000   0\n</gravity>", "<gravity>0 -9.80665000 0</gravity>"),
        ("<a></a><b> </b><c/>", "<a />\n<b />\n<c />"),
        ("<!-- a\n b --><x>1</x><!-- c -->", "<!-- a\n b -->\n<x>1</x>\n<!-- c -->"),
        ("<mass><!-- kg --> 7</mass>", "<mass><!-- kg --> 7</mass>"),
        ("<!--The mass of the body (kg)--><mass>7</mass>", "<mass>7</mass>"),
        (
            "<credits>a &amp; b &lt;c&gt; é\u00a0 d</credits>",
            "<credits>a &amp; b &lt;c&gt; é\u00a0 d</credits>",
        ),
        ("<credits><![CDATA[a < b]]></credits>", "<credits>a &lt; b</credits>"),
        (
            '<x><y name=\'a"b\'\n file = "c.xml"/></x>',
            '<x>\n\t<y name=\'a"b\' file="c.xml" />\n</x>',
        ),
        ("<H::P a:b='1'>2</H::P>", '<H::P a:b="1">2</H::P>'),
        ("<?pi a?><x>1</x>", "<?pi a?>\n<x>1</x>"),
        ("stray <x>1</x> more <y/> <z/> end", "stray <x>1</x> more <y /> <z /> end"),
        ("<credits>Anna & Bert</credits>", "<credits>Anna &amp; Bert</credits>"),
    ],
)
def test_layout_of_an_old_document(inner: str, expected: str) -> None:
    assert laid_out(inner) == expected


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_a_document_in_any_encoding_becomes_utf_8(encoding: str) -> None:
    text = f"<?xml version='1.0' encoding='{encoding.removesuffix('-sig')}'?>" + DOCUMENT.format(
        30000, "<x>é</x>"
    )
    assert "<x>é</x>" in format_document(Source(text.encode(encoding)))


def test_comments_around_the_document_stay() -> None:
    text = "<!-- before -->\n" + DOCUMENT.format(20302, "") + "<!-- behind -->"
    first, before, *_, behind = format_document(Source(text.encode())).splitlines()
    assert (before, behind) == ("<!-- before -->", "<!-- behind -->") and first.startswith("<?xml")


def test_what_no_upgrade_carries_over_is_laid_out_all_the_same() -> None:
    text = DOCUMENT.format(10800, "<of_a_plug_in>\n1 </of_a_plug_in>")
    with pytest.raises(DocumentError, match="which would be lost"):
        read_document(Source(text.encode()))
    assert laid_out("<of_a_plug_in>\n1 </of_a_plug_in>", 10800) == "<of_a_plug_in>1</of_a_plug_in>"


def test_a_document_of_a_version_to_come() -> None:
    assert laid_out("<x>  1</x>", 50000) == "<x>1</x>"


@pytest.mark.parametrize(
    "text",
    ["", "<x/>", "<OpenSimDocument><Model/></OpenSimDocument>", DOCUMENT.format(30000, "<x>")],
)
def test_what_is_no_document_is_refused(text: str) -> None:
    with pytest.raises(DocumentError):
        format_document(Source(text.encode()))
