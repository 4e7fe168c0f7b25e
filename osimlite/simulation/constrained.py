"""Constraints of a motion: free coordinates, constraints on the state, and initial states that fulfil them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from osimlite.mechanics.multibody.constraints import ConstraintEquations, Lock, PrescribedCoordinate
from osimlite.mechanics.multibody.functions import ConstantValue
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array


def find_free_coordinates(mechanism: Mechanism) -> list[int]:
    """Return the indices of the coordinates that belong to the state.

    Locked coordinates do not. Exception: a locked angle of a ball joint whose other angles are
    free. The speeds of that joint are not the rates of its angles, so that a constraint has to hold
    the angle.

    Args:
        mechanism: the mechanism.

    Returns:
        Indices in the order of the mechanism's coordinates.
    """
    rotations = [
        set(indices)
        for body in mechanism.bodies
        for indices in body.mobilizer.turning
        if not all(mechanism.coordinates[index].locked for index in indices)
    ]
    rotating = set().union(*rotations)
    return [
        index
        for index, info in enumerate(mechanism.coordinates)
        if not info.locked or index in rotating
    ]


def select_constraints(
    mechanism: Mechanism, order: Sequence[int]
) -> tuple[list[ConstraintEquations], int]:
    """Return the constraints on the coordinates of a state, and the number of coordinates that are locked besides.

    Args:
        mechanism: the mechanism.
        order: index in the mechanism of each coordinate of the state; the others are locked and
            stay at their defaults.

    Returns:
        The constraints, and the number of locked coordinates that are not in the state.
    """
    constraints: list[ConstraintEquations] = []
    lock_count = 0
    for item in mechanism.constraints:
        if not isinstance(item, Lock):
            constraints.append(item)
        elif item.coordinate in order:
            # A locked coordinate that stays in the state is held at its default value by a
            # constraint.
            value = mechanism.coordinates[item.coordinate].default_value
            constraints.append(
                PrescribedCoordinate(item.coordinate, ConstantValue(value), item.name)
            )
        else:
            lock_count += 1
    return constraints, lock_count


def find_consistent_state(
    mechanism: Mechanism,
    q: Sequence[float],
    u: Sequence[float],
    set_values: Sequence[int],
    set_speeds: Sequence[int],
) -> tuple[Array, Array]:
    """Return the state at time 0 that fulfils the constraints and is nearest to q and u.

    Args:
        mechanism: the mechanism.
        q: values of all coordinates (n,).
        u: generalized speeds of all coordinates (n,).
        set_values: indices of the coordinates whose values do not change.
        set_speeds: indices of the coordinates whose speeds do not change.

    Returns:
        Values (n,) and generalized speeds (n,).

    Raises:
        SimulationError: no such state exists.
    """
    # Positions come first, as in Simbody: the equations of the speeds depend on the pose.
    values = mechanism.assemble(np.array(q), kept=set_values)
    return values, mechanism.project_speeds(values, np.array(u), kept=set_speeds)
