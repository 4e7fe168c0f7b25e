"""To 40600: classes that have changed their name."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, Element, step

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
"""Old names of classes, which OpenSim 4.6 still takes in documents of every version."""

RENAMED_MEMBERS = {"Force": "PointActuator", "Torque": "TorqueActuator"}
"""Old names that say something else outside a set."""


@step(below=40600, order=0)
def class_names(draft: Draft) -> None:
    """Classes get their present names.

    It comes first: the steps after it know the present names only. Defaults of a class under its
    old name keep it: OpenSim passes over them.
    """
    for element in draft.tagged(*RENAMED, *RENAMED_MEMBERS):
        parent = element.getparent()
        place = None if parent is None else parent.tag
        if element.tag in RENAMED_MEMBERS and place == "objects":
            _name(draft, element, RENAMED_MEMBERS[element.tag])
        elif element.tag in RENAMED and place != "defaults":
            _name(draft, element, RENAMED[element.tag])


def _name(draft: Draft, element: Element, new: str) -> None:
    draft.rename(element, new)
    draft.changed(element)
