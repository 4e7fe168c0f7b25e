"""XML that no class of ours stands for: plug-in classes and misspelt tags, kept as they were written."""

from __future__ import annotations

from lxml import etree

from osimlite.errors import ModelError
from osimlite.io.document.comments import is_generated
from osimlite.io.document.escape import escape, quoted
from osimlite.io.document.names import as_written, without_namespaces


def is_element(node: etree._Element) -> bool:
    """Whether a node is an element, and no comment or processing instruction (whose tag is a function)."""
    return type(node.tag) is str


def xml_of(element: etree._Element) -> str:
    """The XML of an element in OpenSim's layout, from the left margin."""
    return "\n".join(lines_of(element, 0))


def relaid(xml: str, depth: int, *, comments: bool = True, name: str | None = None) -> list[str]:
    """The lines of an XML text in OpenSim's layout, `depth` tabs in; `name` replaces its name attribute.

    Raises:
        ModelError: the text is no XML element, or has a DOCTYPE.
    """
    try:
        element = etree.fromstring(
            without_namespaces(xml.encode()), etree.XMLParser(resolve_entities=False)
        )
    except etree.XMLSyntaxError as error:
        raise ModelError(
            f"the content of an unknown component is no XML element: {error.msg}"
        ) from None
    if element.getroottree().docinfo.internalDTD is not None:
        raise ModelError("the content of an unknown component has a DOCTYPE; leave it out")
    if name and element.get("name") != name:
        element.set("name", name)
    return lines_of(element, depth, comments=comments)


def lines_of(element: etree._Element, depth: int, *, comments: bool = True) -> list[str]:
    """The lines of an element in OpenSim's layout; where text and elements mix, white space stays as it was."""
    indent = "\t" * depth
    if not is_element(element):
        if isinstance(element, etree._Comment) and (
            not comments or is_generated(element.text or "")
        ):
            return []
        return [indent + etree.tostring(element, encoding="unicode", with_tail=False)]
    tag = as_written(element.tag)
    head = f"{indent}<{tag}" + "".join(
        f" {key}={quoted(text)}" for key, text in _attributes(element)
    )
    texts = [element.text, *(child.tail for child in element)]
    if not len(element):
        text = "" if element.text is None or element.text.isspace() else escape(element.text)
        return [f"{head}>{text}</{tag}>" if element.text is not None else f"{head} />"]
    if any(text and not text.isspace() for text in texts):
        inner = escape(element.text or "")
        for child in element:
            inner += "\n".join(lines_of(child, 0, comments=comments)) + escape(child.tail or "")
        return [f"{head}>{inner}</{tag}>"]
    lines = [line for child in element for line in lines_of(child, depth + 1, comments=comments)]
    return [f"{head}>", *lines, f"{indent}</{tag}>"] if lines else [f"{head} />"]


def _attributes(element: etree._Element) -> list[tuple[str, str]]:
    return [(as_written(str(key)), str(text)) for key, text in element.items()]
