"""Typed references: a field's type says what it may name and by which of OpenSim's rules the text is resolved.

The rules themselves are in :mod:`osimlite.schema.resolution`. In Python every such field also takes
the component itself.
"""

from __future__ import annotations

from typing import Annotated

from osimlite.schema.base import Component
from osimlite.schema.fields import LEGACY, Fate, Reference

Named = str | Component
Names = tuple[Named, ...]

# Sockets: a path, absolute or from the component that has the socket.
FrameSocket = Annotated[Named, Reference("socket", "Frame")]
PhysicalFrameSocket = Annotated[Named, Reference("socket", "PhysicalFrame")]
BodySocket = Annotated[Named, Reference("socket", "Body")]
StationSocket = Annotated[Named, Reference("socket", "Station")]
CoordinateSocket = Annotated[Named, Reference("socket", "Coordinate")]
ContactGeometrySocket = Annotated[Named, Reference("socket", "ContactGeometry")]
ContactSphereSocket = Annotated[Named, Reference("socket", "ContactSphere")]
ContactHalfSpaceSocket = Annotated[Named, Reference("socket", "ContactHalfSpace")]
MuscleSocket = Annotated[Named, Reference("socket", "Muscle")]
ScalarActuatorSocket = Annotated[Named, Reference("socket", "ScalarActuator")]
ActuatorSockets = Annotated[Names, Reference("socket", "Actuator", "list", required=False)]

# Inputs: a path, a bar and the name of an output.
TransformInput = Annotated[str, Reference("input", "Transform", required=False)]
NumberInput = Annotated[str, Reference("input", "double", required=False)]
NumberInputs = Annotated[tuple[str, ...], Reference("input", "double", "list", required=False)]
Vec3Inputs = Annotated[tuple[str, ...], Reference("input", "Vec3", "list", required=False)]
VectorInputs = Annotated[tuple[str, ...], Reference("input", "Vector", "list", required=False)]

# Names and paths that OpenSim looks up in one place each.
CoordinateName = Annotated[Named, Reference("coordinate-name", "Coordinate")]
MaybeCoordinateName = Annotated[
    Named | None, Reference("coordinate-name", "Coordinate", "optional")
]
CoordinateNames = Annotated[Names, Reference("coordinate-name", "Coordinate", "list")]
CoordinatePaths = Annotated[Names, Reference("model-path", "Coordinate", "list")]
OwnJointCoordinates = Annotated[
    Names, Reference("own-joint-coordinate", "Coordinate", "list", required=False)
]
MaybeBodyName = Annotated[Named | None, Reference("body-name", "Body", "optional")]
FrameName = Annotated[Named, Reference("frame-path-or-body-name", "PhysicalFrame")]
MaybeFrameName = Annotated[
    Named | None, Reference("frame-path-or-body-name", "PhysicalFrame", "optional")
]
ExpressedInFrame = Annotated[
    Named, Reference("frame-path-or-body-name", "PhysicalFrame", required=False, fate="left out")
]
ContactGeometryNames = Annotated[
    Names, Reference("contactgeometry-path-or-name", "ContactGeometry", "list", required=False)
]
WrapObjectName = Annotated[Named, Reference("wrap-object-name", "WrapObject")]
ActuatorNames = Annotated[
    Names, Reference("actuator-name", "Actuator", "list", False, words=("all",), any_case=True)
]
JointNames = Annotated[
    Names, Reference("joint-name", "Joint", "list", False, words=("all",), any_case=True)
]
PathActuatorPath = Annotated[Named, Reference("owner-path", "PathActuator")]
SetMemberNames = Annotated[
    Names, Reference("set-member", "Object", "list", required=False, legacy=True)
]

# What lies outside the model: files and the columns and tables in them.
FileName = Annotated[str, Reference("file", "file", required=False)]
MaybeFileName = Annotated[str | None, Reference("file", "file", "optional", required=False)]
ColumnName = Annotated[str, Reference("column", "column", required=False)]
MaybeColumnName = Annotated[str | None, Reference("column", "column", "optional", required=False)]


def reads(content: str, *, legacy: bool = False, required: bool = False) -> Reference:
    """Marker of a file that a tool reads; `content` is the class of the object in it, or what kind of table it is."""
    return Reference("file", f"{content} file", required=required, legacy=legacy)


def writes(content: str, *, legacy: bool = False, required: bool = False) -> Reference:
    """Marker of a file that a tool writes; without the name of one that is required its results are lost."""
    return Reference("output-file", f"{content} file", required=required, legacy=legacy)


def several(
    rule: str,
    target: str,
    *words: str,
    any_case: bool = False,
    legacy: bool = True,
    fate: Fate = "refused",
) -> Reference:
    """Marker of a list of names, or of `words`, in what a tool is told."""
    return Reference(rule, target, "list", False, legacy, words, fate, any_case)


# What tools name in the model that they work on, and the files that they are given and write.
BodyName = Annotated[Named, Reference("body-name", "Body", required=False, legacy=True)]
LegacyCoordinateName = Annotated[CoordinateName, LEGACY]
LegacyJointNames = Annotated[
    Names, several("joint-name", "Joint", "ALL", any_case=True, fate="left out")
]
InputModel = Annotated[str, reads("Model", required=True)]
LegacyInputModel = Annotated[str, reads("Model", legacy=True, required=True)]
LegacyOutputModel = Annotated[str, writes("Model", legacy=True)]
InputTable = Annotated[str, reads("table")]
LegacyInputTable = Annotated[str, reads("table", legacy=True)]
LegacyInputMotion = Annotated[str, reads("motion", legacy=True, required=True)]
LegacyInputMarkers = Annotated[str, reads("marker data", legacy=True)]
LegacyInputLoads = Annotated[str, reads("ExternalLoads", legacy=True)]
LegacyInputForceSets = Annotated[
    tuple[str, ...], Reference("file", "ForceSet file", "list", required=False, legacy=True)
]
OutputTable = Annotated[str, writes("table")]
LegacyOutputTable = Annotated[str, writes("table", legacy=True)]
OutputFolder = Annotated[str, Reference("output-folder", "folder", required=False)]
LegacyOutputFolder = Annotated[OutputFolder, LEGACY]
