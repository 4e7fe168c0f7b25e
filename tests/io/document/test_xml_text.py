"""Compare escaping of text with the standard library's."""

from __future__ import annotations

from xml.sax import saxutils

from hypothesis import given
from hypothesis import strategies as st

from osimlite.io.document.xml_text import NO_XML, escape_text, quote_attribute

texts = st.text(st.sampled_from("ab&<>\"'\n\r\t é")) | st.text().filter(
    lambda text: not NO_XML.search(text)
)


@given(texts)
def test_content(text: str) -> None:
    assert escape_text(text) == saxutils.escape(text)


@given(texts)
def test_attributes(text: str) -> None:
    assert quote_attribute(text) == saxutils.quoteattr(text)
