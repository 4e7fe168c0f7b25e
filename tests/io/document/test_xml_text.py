"""Escaping equals the standard library's."""

from __future__ import annotations

from xml.sax import saxutils

from hypothesis import given
from hypothesis import strategies as st

from osimlite.io.document.xml_text import NO_XML, escape, quoted

texts = st.text(st.sampled_from("ab&<>\"'\n\r\t é")) | st.text().filter(
    lambda text: not NO_XML.search(text)
)


@given(texts)
def test_content(text: str) -> None:
    assert escape(text) == saxutils.escape(text)


@given(texts)
def test_attributes(text: str) -> None:
    assert quoted(text) == saxutils.quoteattr(text)
