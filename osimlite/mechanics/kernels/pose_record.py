"""Record of a fit of poses: its integers, numbers and workspace besides those of the mechanism."""

from __future__ import annotations

from typing import NamedTuple

from osimlite.mechanics.kernels.layout import Record
from osimlite.mechanics.kernels.pointers import Floats, Ints

# Integers: counts, then offsets in the integers.


class FIT(metaclass=Record):
    """Head of the integers of a fit: counts, then offsets in the integers and in the workspace."""

    MARKERS = 0
    """Number of markers."""
    SENSORS = 1
    """Number of orientation sensors."""
    GOALS = 2
    """Number of coordinates with a measured value."""
    PRESCRIBED = 3
    """Number of coordinates with a prescribed value."""
    COUPLERS = 4
    """Number of couplers."""
    BALLS = 5
    """Number of ball joints."""
    MARKER_AT = 6
    """Offset of the links of the markers."""
    SENSOR_AT = 7
    """Offset of the links of the sensors."""
    GOAL_AT = 8
    """Offset of the degrees of freedom of the goals."""
    PRESCRIBED_AT = 9
    """Offset of the degrees of freedom with prescribed values."""
    COUPLER_AT = 10
    """Offset of the offsets of the couplers' records."""
    BALL_AT = 11
    """Offset of the offsets in the model of the balls' degrees of freedom."""
    AXES_AT = 12
    """Offset of the axes.

    These are the first axis of each link and the end, then per axis its operation and its part of a
    ball, or -1. The axes of a ball are in the order in which they carry one another.
"""
    RESOLVED_AT = 13
    """Offset of the status of each degree of freedom, such as FREEDOM.VARIABLE."""
    FREE_AT = 14
    """Offset of the list of free degrees of freedom."""
    MEASURED = 15
    """Offset in the workspace of the measurements of a frame."""
    WEIGHTS = 16
    """Offset of the weights in this frame."""
    SLOPE = 17
    """Offset of the gradient (n,)."""
    STIFFNESS = 18
    """Offset of the Gauss-Newton part of the Hessian (n, n)."""
    BEND = 19
    """Offset of the remaining part of the Hessian (n, n)."""
    MOMENTS = 20
    """Offset of the sums of forces times arms of each link (3, 3)."""
    ROWS = 21
    """Offset of the derivatives of the equations by the coordinates (m, n)."""
    ERRORS = 22
    """Offset of the errors of the equations (m,)."""
    WORKSPACE = 23
    """Offset of workspace for couplers and linear systems."""
    HISTORY = 24
    """Offset of the number of previous poses, and these poses, the last one first."""
    TRIAL = 25
    """Offset of workspace for a state."""
    STEP = 26
    """Offset of a step (n,)."""
    RANGES_AT = 27
    """Ranges of the coordinates in the numbers."""
    PATTERN = 28
    """Offset of the weights in the previous frame, then 1 if they leave poses alike, else 0."""
    CURVES = 29
    """Offset of the equations' part of the Hessian (n, n), and their multipliers (m,)."""
    HEAD = 30
    """Length of the head of the integers."""


SLIDES = 3
"""First of the parts of a ball that are translations to the ellipsoid, after its rotations."""


class FREEDOM(metaclass=Record):
    """Status of a degree of freedom in a fit."""

    VARIABLE = 0
    """Free degree of freedom."""
    PRESCRIBED = 1
    """Degree of freedom with a prescribed value."""
    DEPENDENT = 2
    """Degree of freedom that is a function of others."""
    AT_END = 3
    """Free degree of freedom that is at an end of its range."""
    UNDETERMINED = 4
    """Free degree of freedom that moves nothing that is measured."""


class COUPLER(metaclass=Record):
    """Integers of a coupler."""

    DEPENDENT = 0
    """Dependent degree of freedom."""
    NUMBERS = 1
    """Offset of its numbers: values of locked arguments, then the table of the function."""
    COUNT = 2
    """Number of arguments."""
    ARGUMENTS = 3
    """Degrees of freedom of the arguments."""


# Numbers: per marker position and weight, per sensor rotation by rows and weight, per goal the
# weight, per degree of freedom the range; then the numbers of the couplers.
MARKER_NUMBERS = 4
"""Length of the numbers of a marker: position in the link (m) and weight."""
SENSOR_NUMBERS = 10
"""Length of the numbers of a sensor: rotation in the link by rows and weight."""

# Offsets in the workspace, which are stored in the integers.


class Fit(NamedTuple):
    """Fit of poses: the mechanism with its workspace, and integers, numbers and workspace of the fit."""

    model: Ints  # integers of the mechanism
    reals: Floats  # numbers of the mechanism
    data: Floats  # workspace of an evaluation
    f: Floats  # workspace of the rates of a state
    p: Ints  # integers of the fit, see `FIT`
    c: Floats  # numbers of the fit, see MARKER_NUMBERS
    v: Floats  # workspace of the fit, see `FIT`
