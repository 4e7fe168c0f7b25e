"""Content of a file that the properties of an object do not hold, and the link to its model."""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING, Any

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, field

if TYPE_CHECKING:
    from osimlite.schema.base import Object
    from osimlite.schema.model import Model


@dataclass(slots=True)
class Layout:
    """Content of a file about one object beyond its properties, preserved for writing.

    Attributes:
        comments: comments before the object.
        before: comments and unknown elements before each property, by tag; None for the end.
        raw: texts that could be read only in part, with the values that were read, by field. A text
            is written back as long as its value is unchanged.
        attributes: unknown attributes.
        after: remarks after the last member of a list.
        version: version of the document, for the object at its top.
        file: path of the document.
        prolog: comments before the root element.
        epilog: comments after the root element.
        defaults: objects of the ``<defaults>`` block of a document.
        inherited: fields whose value was taken from that block.
        include: file that the object was read from, if it was included.
    """

    comments: list[str] = field(default_factory=list)
    before: dict[str | None, list[Remark]] = field(default_factory=dict)
    raw: dict[str, tuple[Any, str]] = field(default_factory=dict)
    attributes: dict[str, str] = field(default_factory=dict)
    after: list[Remark] = field(default_factory=list)
    version: int | None = None
    file: str | None = None
    prolog: list[str] = field(default_factory=list)
    epilog: list[str] = field(default_factory=list)
    defaults: list[Object] = field(default_factory=list)
    inherited: frozenset[str] = frozenset()
    include: Include | None = None

    @property
    def unknown(self) -> list[str]:
        """Unknown child elements as XML text."""
        return [
            remark.text for remarks in self.before.values() for remark in remarks if remark.element
        ]


class Include(NamedTuple):
    """File from which an object was included: its name in the text, its path, and a copy of the object read."""

    file: str
    path: str
    content: Object

    def __deepcopy__(self, memo: object) -> Include:
        # The copy is never modified. Copying it with every object around it would make copies of deeply
        # nested files grow without bound.
        return self


class Remark(NamedTuple):
    """Comment, or unknown element (`element` is true; `text` is its XML)."""

    text: str
    element: bool


class Home:
    """Weak link from the objects of one text to their model.

    A strong reference would be a cycle, and every model read would wait for the garbage collector.
    """

    __slots__ = ("_model",)

    def __init__(self) -> None:
        self._model: weakref.ref[Model] | None = None

    @property
    def model(self) -> Model | None:
        """The model; None before it is built and after it is deleted."""
        return None if self._model is None else self._model()

    @model.setter
    def model(self, model: Model) -> None:
        self._model = weakref.ref(model)
