"""What surrounds an object beyond its properties: what its file said besides, and the model it belongs to."""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING, Any, NamedTuple

from osimlite.base.records import dataclass, field

if TYPE_CHECKING:
    from osimlite.schema.base import Object
    from osimlite.schema.model import Model


@dataclass(slots=True)
class Layout:
    """What a file said about one object beyond its properties, kept so that nothing is lost on writing.

    `comments` stand before the object itself. `before` holds, per tag, the comments and unknown
    elements that stood before that property (key None: at the end). `raw` keeps, per field, text
    that reads only partly, together with the value it was read as: while the value is unchanged the
    text is written back. `attributes` are unknown ones, `after` is what followed the last member of
    a list, `version` the version of a whole document and `file` where that was read from, `prolog`
    and `epilog` the comments before and behind its root element. `defaults` is the ``<defaults>``
    block of a document; `inherited` names the fields whose value an object took from it. `include`
    is there if the object was read from a file of its own.
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
        """The unknown child elements, as XML text."""
        return [
            remark.text for remarks in self.before.values() for remark in remarks if remark.element
        ]


class Include(NamedTuple):
    """Where an object was read from: the file as the text names it, its full path, and a copy of what was read."""

    file: str
    path: str
    held: Object

    def __deepcopy__(self, memo: object) -> Include:
        # What was read does not change. Were it copied with each object around it, files that name
        # each other deeply would be copied without end.
        return self


class Remark(NamedTuple):
    """A comment, or an element that no class knows (`element` true; `text` is its XML)."""

    text: str
    element: bool


class Home:
    """Stands for the model that the objects of one text belong to; it keeps the model as little as they do.

    Were it a cycle of references, every model read would wait for the garbage collector.
    """

    __slots__ = ("_model",)

    def __init__(self) -> None:
        self._model: weakref.ref[Model] | None = None

    @property
    def model(self) -> Model | None:
        """The model, once it is made and as long as it is there."""
        return None if self._model is None else self._model()

    @model.setter
    def model(self, model: Model) -> None:
        self._model = weakref.ref(model)
