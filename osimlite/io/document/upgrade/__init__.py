"""Old formats to the current one, on the element tree and before any class is read.

Each module holds the steps to one version of the format, which its name gives; `upgrade` runs those
that a document needs, oldest first. What the steps do is what OpenSim 4.6 does (its component paths
come out the same), without its rounding of numbers to six digits and without the references it
breaks.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from lxml import etree

from osimlite.io.document.names import as_written
from osimlite.io.document.upgrade.draft import (
    REGISTERED,
    Change,
    Draft,
    Element,
    Refusal,
    Refused,
    Step,
)
from osimlite.io.document.upgrade.v40600_class_names import class_names
from osimlite.schema.model import CURRENT_VERSION

__all__ = [
    "Change",
    "Refusal",
    "Refused",
    "Step",
    "Upgraded",
    "steps",
    "upgrade",
    "with_present_names",
]


def steps(version: int = 0) -> list[Step]:
    """The steps that a document of this version needs, oldest first."""
    return [step for step in _steps_of("v" if version < 40000 else "v4") if version < step.below]


@cache
def _steps_of(prefix: str) -> list[Step]:
    """The steps of the modules whose name begins so, oldest first."""
    for module in iter_modules(__path__):
        if module.name.startswith(prefix):
            import_module(f"{__name__}.{module.name}")
    return sorted(REGISTERED, key=lambda step: step.order)


class Upgraded:
    """What an upgrade made of a document: the `root` of its tree, and what there is to know about it."""

    def __init__(self, draft: Draft) -> None:
        self.root = draft.root
        self._draft = draft

    @property
    def changes(self) -> list[Change]:
        """What the steps did, in the order of the document."""
        return self._draft.changes

    @property
    def refusals(self) -> list[Refusal]:
        """What OpenSim's own upgrade would fail over, if it reads the objects concerned."""
        return self._draft.refusals

    @property
    def numbers(self) -> list[int] | None:
        """For every element of the tree the number of the one it came from; None if all are where they were."""
        draft = self._draft
        return (
            [draft.numbers[element] for element in draft.root.iter(etree.Element)]
            if draft.moves
            else None
        )

    @property
    def moved(self) -> dict[tuple[int, str], int]:
        """The element of the old document for a property, by the number of its owner and its present tag."""
        result: dict[tuple[int, str], int] = {}
        for element in self._draft.touched:
            parent = element.getparent()
            if parent is not None:
                place = (self._draft.numbers[parent], as_written(element.tag))
                result.setdefault(place, self._draft.numbers[element])
        return result


def upgrade(root: Element, version: int) -> Upgraded:
    """Bring the tree of a document, in place, from `version` to the current format.

    Raises:
        Refused: the document says something that no step can carry over.
    """
    draft = Draft(root, version)
    if root.tag != "OpenSimDocument":
        draft.wrap("OpenSimDocument")
    if draft.moves:
        from osimlite.io.document.upgrade.strict import check

        check(draft)
    for step in steps(version):
        draft.step = step
        step.apply(draft)
    return Upgraded(draft)


def with_present_names(root: Element) -> Upgraded | None:
    """Give the classes of a current document their present names, where it uses old ones; None if it does not.

    OpenSim takes the old names in documents of every version.
    """
    draft = Draft(root, CURRENT_VERSION)
    draft.step = next(step for step in REGISTERED if step.apply is class_names)
    class_names(draft)
    return Upgraded(draft) if draft.touched else None
