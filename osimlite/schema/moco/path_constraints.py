"""Constraints of Moco that hold over the whole motion."""

from typing import Annotated

from osimlite.schema.base import Object, make_default, make_empty_list
from osimlite.schema.fields import (
    Flag,
    Integer,
    Many,
    Optional,
    Reference,
    Unnamed,
    Value,
    Vec3,
    real,
)
from osimlite.schema.functions import Function
from osimlite.schema.moco.goals import FramePath, Operation, OutputPath, SecondOutputPath
from osimlite.schema.moco.parts import MocoConstraintInfo
from osimlite.schema.moco.tracking import Projection


class MocoPathConstraint(Object, abstract=True):
    """Constraint that must hold at every time of the motion."""

    moco_constraint_info: Unnamed[MocoConstraintInfo] = make_default(MocoConstraintInfo)
    """Bounds of its equations."""


class MocoControlBoundConstraint(MocoPathConstraint):
    """Controls stay between functions of time."""

    control_paths: Annotated[
        tuple[str, ...], Reference("state-path", "control", "list", required=False)
    ] = ()
    """Paths of the controls."""
    lower_bound: Optional[Function] = None
    """Smallest value over time."""
    upper_bound: Optional[Function] = None
    """Largest value over time."""
    equality_with_lower: Flag = False
    """Whether the controls are equal to `lower_bound`."""


class MocoStateBoundConstraint(MocoPathConstraint):
    """States stay between functions of time."""

    state_paths: Annotated[
        tuple[str, ...], Reference("state-path", "state variable", "list", required=False)
    ] = ()
    """Paths of the states."""
    lower_bound: Optional[Function] = None
    """Smallest value over time."""
    upper_bound: Optional[Function] = None
    """Largest value over time."""
    equality_with_lower: Flag = False
    """Whether the states are equal to `lower_bound`."""


class MocoOutputBoundConstraint(MocoPathConstraint):
    """An output stays between functions of time."""

    output_path: OutputPath = ""
    """The output, as `path|output`."""
    second_output_path: SecondOutputPath = ""
    """Second output, which `operation` combines with the first."""
    operation: Operation = ""
    """Operation that combines the two outputs."""
    exponent: Integer = 1
    """Power to which the result is raised."""
    output_index: Integer = -1
    """Index of the component of an output of several numbers; -1 for its length."""
    lower_bound: Optional[Function] = None
    """Smallest value over time."""
    upper_bound: Optional[Function] = None
    """Largest value over time."""
    equality_with_lower: Flag = False
    """Whether the output is equal to `lower_bound`."""


class MocoFrameDistanceConstraintPair(Object):
    """Two frames whose distance has bounds."""

    frame1_path: FramePath = ""
    """Path of the first frame."""
    frame2_path: FramePath = ""
    """Path of the second frame."""
    minimum_distance: Annotated[float, real("m")] = 0.0
    """Smallest distance of their origins."""
    maximum_distance: Annotated[float, real("m")] = float("inf")
    """Largest distance of their origins."""


class MocoFrameDistanceConstraint(MocoPathConstraint):
    """Frames neither too near nor too far apart."""

    frame_pairs: Many[MocoFrameDistanceConstraintPair] = make_empty_list()
    """Pairs of frames."""
    projection: Projection = "none"
    """Whether only the distance along a vector counts, or in the plane across it."""
    projection_vector: Annotated[Vec3 | None, Value("double", "Vec3", optional=True)] = None
    """That vector, in ground."""
