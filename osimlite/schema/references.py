"""Typed references: the type of a property declares what it may name and by which rule of OpenSim.

The rules are in :mod:`osimlite.schema.resolution`. In Python every such property also accepts the
component itself.
"""

from __future__ import annotations

from typing import Annotated

from osimlite.schema.base import Component
from osimlite.schema.fields import LEGACY, Consequence, Reference

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
    Named,
    Reference("frame-path-or-body-name", "PhysicalFrame", required=False, consequence="left out"),
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

# References out of the model: files, and columns of tables.
FileName = Annotated[str, Reference("file", "file", required=False)]
MaybeFileName = Annotated[str | None, Reference("file", "file", "optional", required=False)]
ColumnName = Annotated[str, Reference("column", "column", required=False)]
MaybeColumnName = Annotated[str | None, Reference("column", "column", "optional", required=False)]


def make_input_file(content: str, *, legacy: bool = False, required: bool = False) -> Reference:
    """Return the marker of a file that a tool reads.

    Args:
        content: class of the object in the file, or kind of table.
        legacy: whether it belongs to the first property system.
        required: whether the tool fails without it.
    """
    return Reference("file", f"{content} file", required=required, legacy=legacy)


def make_output_file(content: str, *, legacy: bool = False, required: bool = False) -> Reference:
    """Return the marker of a file that a tool writes.

    Args:
        content: class of the object in the file, or kind of table.
        legacy: whether it belongs to the first property system.
        required: whether results are lost if the name is empty.
    """
    return Reference("output-file", f"{content} file", required=required, legacy=legacy)


def make_name_list(
    rule: str,
    target: str,
    *words: str,
    any_case: bool = False,
    legacy: bool = True,
    consequence: Consequence = "refused",
) -> Reference:
    """Return the marker of a list of names, or of special words, in the settings of a tool.

    Args:
        rule: rule that resolves the names.
        target: class of the named components.
        words: words that are accepted besides names.
        any_case: whether the words are accepted in any letter case.
        legacy: whether it belongs to the first property system.
        consequence: consequence in OpenSim of a name that leads to nothing.
    """
    return Reference(rule, target, "list", False, legacy, words, consequence, any_case)


# References of tools: to components of their model, and to files that they read and write.
BodyName = Annotated[Named, Reference("body-name", "Body", required=False, legacy=True)]
LegacyCoordinateName = Annotated[CoordinateName, LEGACY]
LegacyJointNames = Annotated[
    Names, make_name_list("joint-name", "Joint", "ALL", any_case=True, consequence="left out")
]
InputModel = Annotated[str, make_input_file("Model", required=True)]
LegacyInputModel = Annotated[str, make_input_file("Model", legacy=True, required=True)]
LegacyOutputModel = Annotated[str, make_output_file("Model", legacy=True)]
InputTable = Annotated[str, make_input_file("table")]
LegacyInputTable = Annotated[str, make_input_file("table", legacy=True)]
LegacyInputMotion = Annotated[str, make_input_file("motion", legacy=True, required=True)]
LegacyInputMarkers = Annotated[str, make_input_file("marker data", legacy=True)]
LegacyInputLoads = Annotated[str, make_input_file("ExternalLoads", legacy=True)]
LegacyInputForceSets = Annotated[
    tuple[str, ...], Reference("file", "ForceSet file", "list", required=False, legacy=True)
]
OutputTable = Annotated[str, make_output_file("table")]
LegacyOutputTable = Annotated[str, make_output_file("table", legacy=True)]
OutputFolder = Annotated[str, Reference("output-folder", "folder", required=False)]
LegacyOutputFolder = Annotated[OutputFolder, LEGACY]
