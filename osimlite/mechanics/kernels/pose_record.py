"""What fitting poses works on: integers, numbers and work of its own beside those of the mechanism."""

from __future__ import annotations

from typing import NamedTuple

from osimlite.mechanics.kernels.pointers import Floats, Ints

# Integers: counts, then places in the integers.
MARKERS, SENSORS, GOALS, HELD, COUPLERS, BALLS = 0, 1, 2, 3, 4, 5
"""Counts; of a marker and a sensor its link, of a goal and what is held its degree of freedom."""
MARKER_AT, SENSOR_AT, GOAL_AT, HELD_AT, COUPLER_AT, BALL_AT = 6, 7, 8, 9, 10, 11
"""Places; of a coupler the place of its record, of a ball that of its three degrees of freedom in the structure."""
AXES_AT = 12
"""Place of the first axis of each link and of the end, and of the axes: the operation, and which
part of a ball or -1; those of a ball in the order in which they carry one another.
"""
SLIDES = 3
"""The first of the parts of a ball that are slides to the ellipsoid, after its turns."""
RESOLVED_AT, FREE_AT = 13, 14
"""Places of what each degree of freedom is, and of a list of those that are free."""
VARIABLE, GIVEN, DEPENDENT = 0, 1, 2
"""What a degree of freedom is: free, held at a value, a function of others."""
AT_END, IDLE = 3, 4
"""What a free one is while it is at an end of its range, or moves nothing that is seen."""
DEPENDENT_OF, NUMBERS_OF, COUNT_OF, ARGUMENTS_OF = 0, 1, 2, 3
"""Of a coupler: the degree of freedom that depends, the place of the numbers, how many it depends
on, and these; the numbers are the values of those that are locked, and the table of the function.
"""

# Numbers: of each marker place and weight, of each sensor the rotation by rows and weight, of each
# goal the weight, of each degree of freedom the range; the numbers of the couplers.
MARKER_NUMBERS, SENSOR_NUMBERS = 4, 10

# Work: places of what is there, in its integers.
MEASURED, WEIGHTS, SLOPE, STIFFNESS, BEND, TURNED = 15, 16, 17, 18, 19, 20
"""What a frame says; the weights in it; gradient (n,) and the two parts of the second derivative
(n, n); of each link the sum of the pulls times the arms (3, 3).
"""
ROWS, ERRORS, ROOM = 21, 22, 23
"""Equations by the coordinates (m, n), their errors (m,), and room for couplers and solving."""
HISTORY, TRIAL, STEP = 24, 25, 26
"""How many poses are kept, and these, the last first; a state; a step (n,)."""
RANGES_AT = 27
"""Offset of the ranges of the coordinates in the numbers."""
PATTERN = 28
"""Place in the work of the weights in the frame before, behind which is 1 if they leave some poses alike, else 0."""
CURVES = 29
"""What the equations add to the second derivative (n, n), and how hard each pulls (m,)."""
FIT_HEAD = 30


class Fit(NamedTuple):
    """A fit: the mechanism with its room, and the integers, numbers and work of the fit."""

    model: Ints
    reals: Floats
    data: Floats
    f: Floats
    p: Ints
    c: Floats
    v: Floats
