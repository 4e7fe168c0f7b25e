"""Record of a fit of poses: its integers, numbers and workspace besides those of the mechanism."""

from __future__ import annotations

from typing import NamedTuple

from osimlite.mechanics.kernels.pointers import Floats, Ints

# Integers: counts, then offsets in the integers.
MARKERS = 0
"""Index in the integers of the number of markers."""
SENSORS = 1
"""Index of the number of orientation sensors."""
GOALS = 2
"""Index of the number of coordinates with a measured value."""
HELD = 3
"""Index of the number of coordinates with a prescribed value."""
COUPLERS = 4
"""Index of the number of couplers."""
BALLS = 5
"""Index of the number of ball joints."""
MARKER_AT = 6
"""Index of the offset of the links of the markers."""
SENSOR_AT = 7
"""Index of the offset of the links of the sensors."""
GOAL_AT = 8
"""Index of the offset of the degrees of freedom of the goals."""
HELD_AT = 9
"""Index of the offset of the degrees of freedom with prescribed values."""
COUPLER_AT = 10
"""Index of the offset of the offsets of the couplers' records."""
BALL_AT = 11
"""Index of the offset of the offsets in the model of the balls' degrees of freedom."""
AXES_AT = 12
"""Index of the offset of the axes.

These are the first axis of each link and the end, then per axis its operation and its part of a
ball, or -1. The axes of a ball are in the order in which they carry one another.
"""
SLIDES = 3
"""First of the parts of a ball that are translations to the ellipsoid, after its rotations."""
RESOLVED_AT = 13
"""Index of the offset of the status of each degree of freedom, such as VARIABLE."""
FREE_AT = 14
"""Index of the offset of the list of free degrees of freedom."""
VARIABLE = 0
"""Status of a free degree of freedom."""
GIVEN = 1
"""Status of a degree of freedom with a prescribed value."""
DEPENDENT = 2
"""Status of a degree of freedom that is a function of others."""
AT_END = 3
"""Status of a free degree of freedom that is at an end of its range."""
IDLE = 4
"""Status of a free degree of freedom that moves nothing that is measured."""
DEPENDENT_OF = 0
"""Index in a coupler of the dependent degree of freedom."""
NUMBERS_OF = 1
"""Index of the offset of its numbers: values of locked arguments, then the table of the function."""
COUNT_OF = 2
"""Index of the number of arguments."""
ARGUMENTS_OF = 3
"""Offset of the degrees of freedom of the arguments."""

# Numbers: per marker position and weight, per sensor rotation by rows and weight, per goal the
# weight, per degree of freedom the range; then the numbers of the couplers.
MARKER_NUMBERS = 4
"""Length of the numbers of a marker: position in the link (m) and weight."""
SENSOR_NUMBERS = 10
"""Length of the numbers of a sensor: rotation in the link by rows and weight."""

# Offsets in the workspace, which are stored in the integers.
MEASURED = 15
"""Index of the offset in the workspace of the measurements of a frame."""
WEIGHTS = 16
"""Index of the offset of the weights in this frame."""
SLOPE = 17
"""Index of the offset of the gradient (n,)."""
STIFFNESS = 18
"""Index of the offset of the Gauss-Newton part of the Hessian (n, n)."""
BEND = 19
"""Index of the offset of the remaining part of the Hessian (n, n)."""
TURNED = 20
"""Index of the offset of the sums of forces times arms of each link (3, 3)."""
ROWS = 21
"""Index of the offset of the derivatives of the equations by the coordinates (m, n)."""
ERRORS = 22
"""Index of the offset of the errors of the equations (m,)."""
ROOM = 23
"""Index of the offset of workspace for couplers and linear systems."""
HISTORY = 24
"""Index of the offset of the number of previous poses, and these poses, the last one first."""
TRIAL = 25
"""Index of the offset of workspace for a state."""
STEP = 26
"""Index of the offset of a step (n,)."""
RANGES_AT = 27
"""Offset of the ranges of the coordinates in the numbers."""
PATTERN = 28
"""Index of the offset of the weights in the previous frame, then 1 if they leave poses alike, else 0."""
CURVES = 29
"""Index of the offset of the equations' part of the Hessian (n, n), and their multipliers (m,)."""
FIT_HEAD = 30
"""Length of the head of the integers."""


class Fit(NamedTuple):
    """Fit of poses: the mechanism with its workspace, and integers, numbers and workspace of the fit."""

    model: Ints  # the mechanism
    reals: Floats  # its numbers
    data: Floats  # workspace of an evaluation
    f: Floats  # workspace of the rates of a state
    p: Ints  # integers of the fit, see MARKERS
    c: Floats  # numbers of the fit, see MARKER_NUMBERS
    v: Floats  # workspace of the fit, see MEASURED
