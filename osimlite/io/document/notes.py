"""What the reader noticed: facts about a text that OpenSim would pass over. The linter turns them into findings."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

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
    """One fact. `number` is the element concerned, in document order.

    `word` is the tag, attribute or part of the text in question; `owner` the object around it and
    `spec` the property, where there is one; `value` is what was read instead (None where the
    default stays). `why` says of a file that is named and not read, as in "which is not there".
    """

    kind: NoteKind
    number: int
    word: str
    owner: Object | None = None
    spec: FieldSpec | None = None
    value: Any = None
    line: int | None = None
    why: str = ""
