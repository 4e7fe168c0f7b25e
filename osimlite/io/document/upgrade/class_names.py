"""Classes that have a new name, in documents of every version."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, Element

RENAMED = {
    "ActuatorSet": "ForceSet",
    "Delp1990Muscle": "Delp1990Muscle_Deprecated",
    "GeneralizedForce": "CoordinateActuator",
    "IKTool": "InverseKinematicsTool",
    "MovingMusclePoint": "MovingPathPoint",
    "MuscleMetabolicPowerProbeUmberger2010": "Umberger2010MuscleMetabolicsProbe",
    "MuscleMetabolicPowerProbeUmberger2010_MetabolicMuscleParameter": (
        "Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameter"
    ),
    "MuscleMetabolicPowerProbeUmberger2010_MetabolicMuscleParameterSet": (
        "Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameterSet"
    ),
    "MusclePoint": "PathPoint",
    "MusclePointSet": "PathPointSet",
    "MuscleViaPoint": "ConditionalPathPoint",
    "MuscleWrap": "PathWrap",
    "MuscleWrapSet": "PathWrapSet",
    "NaturalCubicSpline": "SimmSpline",
    "Schutte1993Muscle": "Schutte1993Muscle_Deprecated",
    "natCubicSpline": "SimmSpline",
    "rdCMC_Joint": "CMC_Joint",
    "rdCMC_Point": "CMC_Point",
    "rdCMC_TaskSet": "CMC_TaskSet",
}


"""New names of classes by their old names, which OpenSim 4.6 accepts in documents of every version."""


RENAMED_MEMBERS = {"Force": "PointActuator", "Torque": "TorqueActuator"}


"""New names of classes by old names that have another meaning outside a set."""


def rename_classes(draft: Draft) -> None:
    """Rename classes that have an old name.

    Defaults of a class under its old name keep that name, because OpenSim ignores them.
    """
    for element in draft.find_tagged(*RENAMED, *RENAMED_MEMBERS):
        parent = element.getparent()
        parent_tag = None if parent is None else parent.tag
        if element.tag in RENAMED_MEMBERS and parent_tag == "objects":
            _rename_class(draft, element, RENAMED_MEMBERS[element.tag])
        elif element.tag in RENAMED and parent_tag != "defaults":
            _rename_class(draft, element, RENAMED[element.tag])


def _rename_class(draft: Draft, element: Element, new: str) -> None:
    """Rename an element and record the change."""
    draft.rename(element, new)
    draft.record_change(element)
