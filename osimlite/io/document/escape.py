"""Text as it stands in XML. The standard library's functions for this import the whole of its network code."""

from __future__ import annotations

import re

from osimlite.errors import ModelError

NO_XML = re.compile("[\\0-\\x08\\x0b\\x0c\\x0e-\\x1f\\ud800-\\udfff\\ufffe\\uffff]")
"""Characters that XML cannot hold."""


def escape(text: str) -> str:
    """`text` as the content of an element; ModelError if XML cannot hold it."""
    if not text.isprintable() and (odd := NO_XML.search(text)):
        start = odd.start()
        raise ModelError(
            f"no file can hold the last character of '{text[max(0, start - 40) : start + 1]}'; take it out"
        )
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def quoted(text: str) -> str:
    """`text` as the value of an attribute, with its quotation marks."""
    inner = escape(text).replace("\n", "&#10;").replace("\r", "&#13;").replace("\t", "&#9;")
    if '"' not in inner:
        return f'"{inner}"'
    return f"'{inner}'" if "'" not in inner else '"' + inner.replace('"', "&quot;") + '"'
