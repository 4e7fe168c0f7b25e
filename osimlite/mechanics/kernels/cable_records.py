"""Records of cables: integers and numbers of a cable and of its elements, and their workspace.

Elements of a cable are its points and its obstacles, in the order of the path.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.cable_surfaces import (
    END_NUMBERS,
    GEODESIC,
)
from osimlite.mechanics.kernels.layout import ITEM, Record


class CABLE(metaclass=Record):
    """Integers of a cable."""

    COUNT = ITEM.DETAILS + 1
    """Number of its elements."""
    SOLVER = ITEM.DETAILS + 2
    """Offset in the record of the workspace of the search."""
    ELEMENTS = ITEM.DETAILS + 3
    """Elements."""


class ELEMENT(metaclass=Record):
    """Integers of an element of a cable."""

    IS_OBSTACLE = 0
    """1 for an obstacle, 0 for a point."""
    LINK = 1
    """Link."""
    AT = 2
    """Offset of its numbers."""
    RECORD = 3
    """Offset of its part of the record."""
    SIZE = 4
    """Number of integers of an element."""


class CABLE_WORK(metaclass=Record):
    """Record of a cable behind that of any path, see `PATH_WORK`."""

    FIRST = 3
    """Parts of the elements."""


class CABLE_POINT(metaclass=Record):
    """Numbers of a point of a cable."""

    STATION = 0
    """Station that the cable passes (m)."""
    PULL_STATION = 3
    """Station at which the cable pulls (m)."""


class CABLE_POINT_WORK(metaclass=Record):
    """Record of a point; its position in ground comes first."""

    BEFORE = 3
    """Direction before it."""
    AFTER = 6
    """Direction after it."""
    SIZE = 9
    """Length of the record of a point."""


class OBSTACLE_WORK(metaclass=Record):
    """Record of an obstacle."""

    STATE = 0
    """State, such as OBSTACLE_STATE.TOUCHES."""
    TRACKED = 1
    """Point of a line that was nearest to the surface, or of a guess."""
    CURVE = 4
    """Geodesic, see `GEODESIC`."""
    TOUCH_SIZE = CURVE + GEODESIC.SIZE
    """Length of state, point and geodesic."""
    IN_GROUND = TOUCH_SIZE
    """Pose in ground."""
    GROUND_START = TOUCH_SIZE + 12
    """First end of the geodesic in ground."""
    GROUND_END = TOUCH_SIZE + 12 + END_NUMBERS.SIZE
    """Last end of the geodesic in ground."""
    SIZE = GROUND_END + END_NUMBERS.SIZE
    """Length of the record of an obstacle."""


class OBSTACLE(metaclass=Record):
    """Numbers of an obstacle."""

    POSE = 0
    """Rotation in the link by rows, then its origin."""
    BEGIN = 12
    """State, point and geodesic at the start of the search."""
    SURFACE = 12 + OBSTACLE_WORK.TOUCH_SIZE
    """Numbers of its surface."""


class OBSTACLE_STATE(metaclass=Record):
    """States of an obstacle."""

    TOUCHES = 0.0
    """Obstacle that the cable touches."""
    GUESSED = 1.0
    """Obstacle that the cable touches near a guess."""
    LIFTED = 2.0
    """Obstacle that the cable does not touch."""
