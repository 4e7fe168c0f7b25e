"""Text of XML: escapes, generated comments, and elements without a class in OpenSim's layout.

Elements of plug-in classes and misspelt tags are written as they were read. OpenSim prints the
description of a property as a comment before each property. The comments that a person wrote are
kept; those that OpenSim prints are recognized by their digests and dropped.
"""

from __future__ import annotations

import re
from functools import cache, lru_cache
from pathlib import Path

from lxml import etree

from osimlite.errors import ModelError
from osimlite.io.document.names import as_written, replace_colons

DIGEST_SIZE = 6

_COMMENT = re.compile(rb"<!--([^-]*+(?:-[^-]++)*+)-->")


@lru_cache(maxsize=4096)
def is_generated_comment(text: str) -> bool:
    """Whether a comment is one that some version of OpenSim prints by itself."""
    return compute_digest(text) in _load_digests()


def has_only_generated_comments(data: bytes) -> bool:
    """Whether a UTF-8 text has no comment but OpenSim's own; half of the nodes of such a text are comments."""
    return all(
        is_generated_comment(text.decode(errors="replace")) for text in set(_COMMENT.findall(data))
    )


def compute_digest(text: str) -> bytes:
    """Digest of a comment, white space and digits aside."""
    # The library behind it takes longer to load than most files do to read, and many have no
    # comments.
    from hashlib import blake2b

    plain = re.sub(r"[\s\d]+", " ", text).strip()
    return blake2b(plain.encode(), digest_size=DIGEST_SIZE).digest()


@cache
def _load_digests() -> frozenset[bytes]:
    data = Path(__file__).with_name("generated_comments.bin").read_bytes()
    return frozenset(data[i : i + DIGEST_SIZE] for i in range(0, len(data), DIGEST_SIZE))


NO_XML = re.compile("[\\0-\\x08\\x0b\\x0c\\x0e-\\x1f\\ud800-\\udfff\\ufffe\\uffff]")
"""Characters that XML cannot hold."""


def escape_text(text: str) -> str:
    """`text` as the content of an element; ModelError if XML cannot hold it."""
    if not text.isprintable() and (odd := NO_XML.search(text)):
        start = odd.start()
        raise ModelError(
            f"no file can hold the last character of '{text[max(0, start - 40) : start + 1]}'; take it out"
        )
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def quote_attribute(text: str) -> str:
    """`text` as the value of an attribute, with its quotation marks."""
    inner = escape_text(text).replace("\n", "&#10;").replace("\r", "&#13;").replace("\t", "&#9;")
    if '"' not in inner:
        return f'"{inner}"'
    return f"'{inner}'" if "'" not in inner else '"' + inner.replace('"', "&quot;") + '"'


def is_element(node: etree._Element) -> bool:
    """Whether a node is an element, and no comment or processing instruction (whose tag is a function)."""
    return type(node.tag) is str


def format_element(element: etree._Element) -> str:
    """The XML of an element in OpenSim's layout, from the left margin."""
    return "\n".join(list_lines(element, 0))


def format_xml(
    xml: str, depth: int, *, comments: bool = True, name: str | None = None
) -> list[str]:
    """The lines of an XML text in OpenSim's layout, `depth` tabs in; `name` replaces its name attribute.

    Raises:
        ModelError: the text is no XML element, or has a DOCTYPE.
    """
    try:
        element = etree.fromstring(
            replace_colons(xml.encode()), etree.XMLParser(resolve_entities=False)
        )
    except etree.XMLSyntaxError as error:
        raise ModelError(
            f"the content of an unknown component is no XML element: {error.msg}"
        ) from None
    if element.getroottree().docinfo.internalDTD is not None:
        raise ModelError("the content of an unknown component has a DOCTYPE; leave it out")
    if name and element.get("name") != name:
        element.set("name", name)
    return list_lines(element, depth, comments=comments)


def list_lines(element: etree._Element, depth: int, *, comments: bool = True) -> list[str]:
    """The lines of an element in OpenSim's layout; where text and elements mix, white space stays as it was."""
    indent = "\t" * depth
    if not is_element(element):
        if isinstance(element, etree._Comment) and (
            not comments or is_generated_comment(element.text or "")
        ):
            return []
        return [indent + etree.tostring(element, encoding="unicode", with_tail=False)]
    tag = as_written(element.tag)
    head = f"{indent}<{tag}" + "".join(
        f" {key}={quote_attribute(text)}" for key, text in _list_attributes(element)
    )
    texts = [element.text, *(child.tail for child in element)]
    if not len(element):
        text = "" if element.text is None or element.text.isspace() else escape_text(element.text)
        return [f"{head}>{text}</{tag}>" if element.text is not None else f"{head} />"]
    if any(text and not text.isspace() for text in texts):
        inner = escape_text(element.text or "")
        for child in element:
            inner += "\n".join(list_lines(child, 0, comments=comments)) + escape_text(
                child.tail or ""
            )
        return [f"{head}>{inner}</{tag}>"]
    lines = [line for child in element for line in list_lines(child, depth + 1, comments=comments)]
    return [f"{head}>", *lines, f"{indent}</{tag}>"] if lines else [f"{head} />"]


def _list_attributes(element: etree._Element) -> list[tuple[str, str]]:
    return [(as_written(str(key)), str(text)) for key, text in element.items()]
