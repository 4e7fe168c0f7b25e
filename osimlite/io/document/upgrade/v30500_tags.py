"""To 10900, 10904, 20002, 20302, 30000 and 30500: properties that say the same under another tag."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, step


def _renaming(name: str, below: int, family: str, **tags: str) -> None:
    """Register the step `name` that gives properties of a class, and of those derived from it, other tags."""

    def renamed(draft: Draft) -> None:
        for component in draft.every(family):
            if any([draft.rename_child(component, old, new) for old, new in tags.items()]):
                draft.changed(component)

    renamed.__name__ = name
    renamed.__doc__ = (
        f"Of a {family} {' and '.join(f'<{old}> is called <{new}>' for old, new in tags.items())}."
    )
    step(below=below)(renamed)


_renaming("replaced_forces", 10900, "AbstractTool", replace_actuator_set="replace_force_set")
_renaming("force_files", 10904, "AbstractTool", actuator_set_files="force_set_files")
_renaming("conditional_coordinates", 20002, "ConditionalPathPoint", coordinates="coordinate")
_renaming("pennation_angles", 20302, "Muscle", pennation_angle="pennation_angle_at_optimal")
_renaming(
    "moving_locations", 30000, "MovingPathPoint",
    XAttachment="x_location", YAttachment="y_location", ZAttachment="z_location",
)  # fmt: skip
_renaming(
    "joint_child_places",
    30500,
    "Joint",
    location="location_in_child",
    orientation="orientation_in_child",
)
