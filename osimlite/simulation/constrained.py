"""The constraints of a motion: which coordinates are free, what is kept up, and a start that fulfils it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from osimlite.mechanics.multibody.constraints import Constraint, Lock, Prescribed
from osimlite.mechanics.multibody.functions import Constant
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array


def free_coordinates(mechanism: Mechanism) -> list[int]:
    """Places of the coordinates that are not simply at rest.

    A locked angle of a ball joint whose other angles are free is one of them: the speeds of the
    joint are not those of its angles, so that it takes a constraint to hold it.
    """
    turning = [
        set(motion_places)
        for body in mechanism.bodies
        for motion_places in body.mobilizer.turning
        if not all(mechanism.coordinates[place].locked for place in motion_places)
    ]
    held = set().union(*turning)
    return [
        place
        for place, info in enumerate(mechanism.coordinates)
        if not info.locked or place in held
    ]


def constraints_on(mechanism: Mechanism, order: Sequence[int]) -> tuple[list[Constraint], int]:
    """What is kept up on the coordinates of a state, and how many coordinates are locked besides.

    Args: mechanism: whose constraints. order: place in the mechanism of each coordinate of the
        state; the others are locked, and stay at their defaults.
    """
    kept: list[Constraint] = []
    locks = 0
    for item in mechanism.constraints:
        if not isinstance(item, Lock):
            kept.append(item)
        elif item.coordinate in order:
            value = mechanism.coordinates[item.coordinate].default_value
            kept.append(Prescribed(item.coordinate, Constant(value), item.name))
        else:
            locks += 1
    return kept, locks


def kept_state(
    mechanism: Mechanism,
    q: Sequence[float],
    u: Sequence[float],
    set_values: Sequence[int],
    set_speeds: Sequence[int],
) -> tuple[Array, Array]:
    """The state at time 0 nearest to q (n,) and u (n,) in which the constraints hold.

    Args:
        mechanism: whose state.
        q: values of all coordinates.
        u: generalized speeds of all coordinates.
        set_values: places of the coordinates whose values stay.
        set_speeds: places of those whose speeds do.

    Raises:
        SimulationError: there is none.
    """
    values = mechanism.assemble(np.array(q), kept=set_values)
    return values, mechanism.project_speeds(values, np.array(u), kept=set_speeds)
