"""Upgrade of documents from old format versions to the current one.

The upgrade works on the element tree, before any class of the schema is read. `STEP_TABLE` lists
its steps in the order in which they run, with the functions that carry them out. Each step does
what OpenSim 4.6 does, so that component paths come out equal, but without OpenSim's rounding of
numbers to six digits and without the references that OpenSim breaks.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module

from lxml import etree

from osimlite.io.document.names import decode_name
from osimlite.io.document.upgrade.class_names import rename_classes
from osimlite.io.document.upgrade.draft import (
    Change,
    Draft,
    Element,
    Refusal,
    UpgradeError,
    UpgradeStep,
)
from osimlite.schema.model import CURRENT_VERSION

__all__ = [
    "STEP_TABLE",
    "Change",
    "Refusal",
    "UpgradeError",
    "UpgradeResult",
    "UpgradeStep",
    "list_steps",
    "rename_old_classes",
    "upgrade",
]

STEP_TABLE = (
    # Before all others, because they know the present names of classes only.
    (40600, "class_names", "class_names.rename_classes"),
    # The content of the engine has to be in the model before steps search the model.
    (10901, "engine", "before_version_3.move_engine_content"),
    (10900, "replaced_forces", "before_version_3.rename_replaced_forces"),
    (10901, "transform_axes", "before_version_3.convert_transform_axes"),
    # It needs the axes of the step before.
    (10901, "scale_factors", "before_version_3.apply_scale_factors"),
    (10904, "tool_controls", "before_version_3.convert_tool_controls"),
    (10904, "force_files", "before_version_3.rename_force_files"),
    (10905, "actuator_bodies", "before_version_3.convert_actuator_bodies"),
    (20001, "external_loads", "before_version_3.report_external_loads"),
    (20002, "conditional_coordinates", "before_version_3.rename_conditional_coordinates"),
    (20101, "geometry_files", "before_version_3.convert_geometry_files"),
    (20202, "one_trial", "before_version_3.move_first_trial"),
    (20202, "inverse_dynamics", "before_version_3.convert_inverse_dynamics"),
    (20301, "external_forces", "before_version_3.convert_external_forces"),
    (20302, "muscle_paths", "before_version_3.collect_muscle_paths"),
    (20302, "pennation_angles", "before_version_3.rename_pennation_angles"),
    (30000, "moving_locations", "before_version_3.rename_moving_locations"),
    # These three run early, so that the steps that write sockets meet one spelling only.
    (30508, "connectors", "version_3_references.convert_connectors"),
    (30510, "connectors_renamed", "version_3_references.rename_connectors"),
    (30517, "connectee_names", "version_3_references.shorten_connectee_names"),
    (30500, "body_inertia", "version_3_structure.combine_inertia"),
    (30500, "names", "version_3_structure.remove_white_space"),
    (30500, "joint_child_places", "version_3_structure.rename_joint_child_locations"),
    (30500, "constraint_bodies", "version_3_references.convert_constraint_bodies"),
    (30501, "ground", "version_3_structure.convert_ground"),
    (30501, "joints", "version_3_structure.move_joints"),
    (30501, "marker_frames", "version_3_references.convert_marker_frames"),
    (30502, "display_geometry", "version_3_appearance.convert_display_geometry"),
    (30505, "joint_frames", "version_3_references.add_joint_frames"),
    (30505, "linker_frames", "version_3_references.add_linker_frames"),
    (30505, "point_bodies", "version_3_references.convert_point_bodies"),
    (30505, "contact_bodies", "version_3_references.convert_contact_bodies"),
    (30505, "point_coordinates", "version_3_references.convert_point_coordinates"),
    (30505, "hidden_appearance", "version_3_appearance.hide_appearance"),
    (30506, "force_frames", "version_3_references.convert_force_frames"),
    (30506, "geometry_lists", "version_3_appearance.move_geometry_lists"),
    (30507, "joint_coordinates", "version_3_structure.list_joint_coordinates"),
    (30507, "contact_appearance", "version_3_appearance.convert_contact_appearance"),
    (30509, "switched_on", "version_3_structure.invert_switches"),
    (30511, "probes_switched_on", "version_3_structure.invert_probe_switches"),
    (30512, "frame_set", "version_3_structure.move_frame_set"),
    (30513, "control_bounds", "version_3_structure.remove_usual_bounds"),
    (30514, "reverse", "version_3_structure.apply_reverse"),
    (30514, "motion_type", "version_3_structure.remove_motion_type"),
    (30515, "wrap_appearance", "version_3_appearance.convert_wrap_appearance"),
    (30516, "path_appearance", "version_3_appearance.convert_path_appearance"),
    (30517, "set_levels", "version_3_references.complete_body_paths"),
    (40000, "axis_functions", "version_4.complete_axis_functions"),
    (40000, "meaningless", "version_4.remove_meaningless"),
    (40500, "path_names", "version_4.name_paths"),
    (40600, "controller_actuators", "version_4.convert_controller_actuators"),
)
"""Steps in the order in which they run: version that needs no such step, name, module and function.

A module is imported when a document needs one of its steps.
"""


def list_steps(version: int = 0) -> list[UpgradeStep]:
    """Return the steps that a document of this version needs, in the order in which they run."""
    return [
        _load_step(below, name, function) for below, name, function in STEP_TABLE if version < below
    ]


@cache
def _load_step(below: int, name: str, function: str) -> UpgradeStep:
    """Return the step of a row of `STEP_TABLE`."""
    module, _, attribute = function.partition(".")
    return UpgradeStep(below, name, getattr(import_module(f"{__name__}.{module}"), attribute))


class UpgradeResult:
    """Result of an upgrade: the `root` of the new tree, and what the steps did."""

    def __init__(self, draft: Draft) -> None:
        self.root = draft.root
        self._draft = draft

    @property
    def changes(self) -> list[Change]:
        """Changes that the steps made, in the order of the document."""
        return self._draft.changes

    @property
    def refusals(self) -> list[Refusal]:
        """Elements over which OpenSim's own upgrade fails if it reads the objects concerned."""
        return self._draft.refusals

    @property
    def numbers(self) -> list[int] | None:
        """Index in the old document of every element's source; None if no element was moved."""
        draft = self._draft
        return (
            [draft.numbers[element] for element in draft.root.iter(etree.Element)]
            if draft.moves_elements
            else None
        )

    @property
    def old_indices(self) -> dict[tuple[int, str], int]:
        """Indices of changed properties in the old document.

        Returns:
            Index of the property by the index of its owner and its present tag.
        """
        result: dict[tuple[int, str], int] = {}
        for element in self._draft.changed_elements:
            parent = element.getparent()
            if parent is not None:
                key = (self._draft.numbers[parent], decode_name(element.tag))
                result.setdefault(key, self._draft.numbers[element])
        return result


def upgrade(root: Element, version: int) -> UpgradeResult:
    """Upgrade the tree of a document in place to the current format.

    Args:
        root: root of the document, of any class.
        version: format version of the document.

    Returns:
        Upgraded tree, with the changes that the steps made.

    Raises:
        UpgradeError: the document has content that no step can carry over.
    """
    draft = Draft(root, version)
    if root.tag != "OpenSimDocument":
        draft.wrap_root("OpenSimDocument")
    if draft.moves_elements:
        from osimlite.io.document.upgrade.strict import check_strict_reading

        check_strict_reading(draft)
    for step in list_steps(version):
        draft.step = step
        step.apply(draft)
    return UpgradeResult(draft)


def rename_old_classes(root: Element) -> UpgradeResult | None:
    """Rename the classes of a current document that have an old name.

    OpenSim accepts the old names in documents of every version.

    Returns:
        Tree with the changes; None if no class has an old name.
    """
    draft = Draft(root, CURRENT_VERSION)
    draft.step = _load_step(*STEP_TABLE[0])
    rename_classes(draft)
    return UpgradeResult(draft) if draft.changed_elements else None
