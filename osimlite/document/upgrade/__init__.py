"""Old formats to the current one, on the element tree and before any class is read.

Each module holds the steps to one version of the format, which its name gives; `upgrade` runs those that a document
needs, oldest first. What the steps do is what OpenSim 4.6 does (its component paths come out the same), without its
rounding of numbers to six digits and without the references it breaks.
"""

from __future__ import annotations

from lxml import etree

from osimlite.document.upgrade import (
    v10601_engine,  # noqa: F401
    v10901_scale_factors,  # noqa: F401
    v10901_transform_axes,  # noqa: F401
    v10905_point_actuators,  # noqa: F401
    v20002_conditional_points,  # noqa: F401
    v20101_geometry_files,  # noqa: F401
    v20302_muscles,  # noqa: F401
    v30000_moving_points,  # noqa: F401
    v30500_bodies,  # noqa: F401
    v30500_names,  # noqa: F401
    v30501_ground_and_joints,  # noqa: F401
    v30502_geometry,  # noqa: F401
    v30505_offset_frames,  # noqa: F401
    v30505_references,  # noqa: F401
    v30506_components,  # noqa: F401
    v30507_coordinates_and_contact,  # noqa: F401
    v30509_switches,  # noqa: F401
    v30512_frame_set,  # noqa: F401
    v30513_controls,  # noqa: F401
    v30514_reverse,  # noqa: F401
    v30515_wrap_objects,  # noqa: F401
    v30516_paths,  # noqa: F401
    v30517_sockets,  # noqa: F401
    v40000_axis_functions,  # noqa: F401
    v40000_meaningless,  # noqa: F401
    v40500_path_names,  # noqa: F401
    v40600_controllers,  # noqa: F401
)
from osimlite.document.upgrade.draft import STEPS, Change, Draft, Element, Refused
from osimlite.document.upgrade.v40600_class_names import class_names
from osimlite.schema.model import CURRENT_VERSION

__all__ = ["STEPS", "Change", "Refused", "Upgraded", "upgrade", "with_present_names"]


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
    def numbers(self) -> list[int] | None:
        """For every element of the tree the number of the one it came from; None if all are where they were."""
        draft = self._draft
        return [draft.numbers[element] for element in draft.root.iter(etree.Element)] if draft.moves else None

    @property
    def moved(self) -> dict[tuple[int, str], int]:
        """The element of the old document for a property, by the number of its owner and its present tag."""
        found: dict[tuple[int, str], int] = {}
        for element in self._draft.touched:
            parent = element.getparent()
            if parent is not None:
                found.setdefault((self._draft.numbers[parent], element.tag), self._draft.numbers[element])
        return found


def upgrade(root: Element, version: int) -> Upgraded:
    """Bring the tree of a document, in place, from `version` to the current format.

    Raises:
        Refused: the document says something that no step can carry over.
    """
    draft = Draft(root, version)
    if root.tag == "Model":
        draft.wrap("OpenSimDocument")
    for step in sorted(STEPS, key=lambda step: step.order):
        if version < step.below:
            draft.step = step
            step.apply(draft)
    return Upgraded(draft)


def with_present_names(root: Element) -> Upgraded | None:
    """Give the classes of a current document their present names, where it uses old ones; None if it does not.

    OpenSim takes the old names in documents of every version.
    """
    draft = Draft(root, CURRENT_VERSION)
    draft.step = next(step for step in STEPS if step.apply is class_names)
    class_names(draft)
    return Upgraded(draft) if draft.touched else None
