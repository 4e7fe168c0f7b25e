"""Notes of the reader about content that OpenSim ignores; the linter turns them into findings."""

from __future__ import annotations

from typing import Any, Literal

from osimlite.base.named_tuples import NamedTuple
from osimlite.schema.base import Object
from osimlite.schema.specs import FieldSpec

NoteKind = Literal[
    "unknown-tag",
    "unknown-class",
    "wrong-class",
    "wrong-name",
    "unknown-attribute",
    "duplicate-tag",
    "child-in-value",
    "stray-text",
    "unreadable",
    "cut",
    "too-many",
    "too-few",
    "empty",
    "ignored",
    "second-object",
    "encoding",
    "include",
    "bare-ampersand",
    "duplicate-attribute",
    "hyphens-in-comment",
    "control-character",
    "byte-order-mark",
    "late-declaration",
    "overlooked",
    "text-outside-root",
]


class Note(NamedTuple):
    """Note of the reader about one element.

    Attributes:
        kind: type of the note.
        number: index of the element in document order.
        word: tag, attribute or part of the text.
        owner: object that contains the element.
        spec: property that the element sets, if any.
        value: value that was read instead; None if the default stays.
        line: line of the element, if it is known.
        why: reason why a named file was not read, as the end of a sentence such as "does not exist".
    """

    kind: NoteKind
    number: int
    word: str
    owner: Object | None = None
    spec: FieldSpec | None = None
    value: Any = None
    line: int | None = None
    why: str = ""
