"""One layout for documents of every version."""

from __future__ import annotations

from lxml import etree

from osimlite.errors import NotWellFormedError
from osimlite.io.document.foreign import lines_of
from osimlite.io.document.lexical import split
from osimlite.io.document.printer import DECLARATION, to_text
from osimlite.io.document.reader import document_of, parse, version_of
from osimlite.io.document.source import Source
from osimlite.schema.base import Object
from osimlite.schema.model import CURRENT_VERSION


def formatted(source: Source) -> str:
    """The text of a document in the layout in which it would be printed.

    A document of the current version is read and printed. One of another keeps its version and its
    words: only white space changes, and the comments that OpenSim prints by itself are dropped.

    Raises:
        DocumentError: the text is not an OpenSim document; with line and column.
    """
    try:
        root = parse(source)
    except NotWellFormedError as fault:
        from osimlite.io.document.repair import read_repaired

        root, _ = read_repaired(source, fault, parse)
    version = version_of(source, root)
    if version == CURRENT_VERSION:
        return to_text(document_of(source, root, version, Object).top)
    for element in root.iter(etree.Element):
        if not len(element):
            element.text = " ".join(split(element.text or "")) or None
    nodes = [*[*root.itersiblings(preceding=True)][::-1], root, *root.itersiblings()]
    return "\n".join([DECLARATION, *(line for node in nodes for line in lines_of(node, 0))]) + "\n"
