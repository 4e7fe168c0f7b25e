"""Between the generalized speeds of a mechanism and the rates of one-axis joints.

They differ for ball, free, ellipsoid and scapulothoracic joints only, whose rotational speeds u are angular
velocities: qdot = N u.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from osimlite.errors import UnsupportedError
from osimlite.multibody.joints import Mobilizer
from osimlite.multibody.mechanism import Mechanism
from osimlite.multibody.spatial import Array


class Speeds:
    """Conversions for the joints whose speeds are not the rates of their coordinates.

    All lists are in the order of an engine's degrees of freedom.

    Args:
        mechanism: whose joints.
        order: place in the mechanism of the coordinate of each degree of freedom.

    Raises:
        UnsupportedError: some, but not all coordinates of such a joint are locked.
    """

    def __init__(self, mechanism: Mechanism, order: Sequence[int]) -> None:
        place_of = {place: joint for joint, place in enumerate(order)}
        self._turning: list[tuple[Mobilizer, list[int]]] = []
        for body in mechanism.bodies:
            mobilizer = body.mobilizer
            if mobilizer.speeds_are_rates:
                continue
            joints = [place_of.get(place) for place in mobilizer.coordinates]
            free = [joint for joint in joints if joint is not None]
            if free and len(free) < len(joints):
                raise UnsupportedError(
                    f"'{mobilizer.joint}' ({mobilizer.joint_type}) has locked and free coordinates, which the "
                    "simulation cannot do; lock all of them or none"
                )
            if free:
                self._turning.append((mobilizer, free))

    def rates(self, q: Sequence[float], u: Sequence[float]) -> list[float]:
        """Qdot = N u; SimulationError where N is singular."""
        result = list(u)
        for mobilizer, joints in self._turning:
            own = mobilizer.rate_matrix(_pick(q, joints)) @ _pick(u, joints)
            _put(result, joints, own)
        return result

    def from_rates(self, q: Sequence[float], rates: Sequence[float]) -> list[float]:
        """u = N⁻¹ qdot; SimulationError where N is singular."""
        result = list(rates)
        for mobilizer, joints in self._turning:
            _put(result, joints, np.linalg.solve(mobilizer.rate_matrix(_pick(q, joints)), _pick(rates, joints)))
        return result

    def accelerations(self, q: Sequence[float], u: Sequence[float], qddot: Sequence[float]) -> list[float]:
        """Udot = N⁻¹ (qddot - Ndot u); SimulationError where N is singular."""
        result = list(qddot)
        for mobilizer, joints in self._turning:
            values, speeds = _pick(q, joints), _pick(u, joints)
            rest = _pick(qddot, joints) - mobilizer.rate_bias(values, speeds)
            _put(result, joints, np.linalg.solve(mobilizer.rate_matrix(values), rest))
        return result

    def joint_forces(self, q: Sequence[float], forces: Sequence[float]) -> list[float]:
        """Forces on the joints, N⁻ᵀ f, that do what forces f conjugate to the generalized speeds do."""
        result = list(forces)
        for mobilizer, joints in self._turning:
            if any(forces[joint] for joint in joints):
                matrix = mobilizer.rate_matrix(_pick(q, joints)).T
                _put(result, joints, np.linalg.solve(matrix, _pick(forces, joints)))
        return result


def _pick(values: Sequence[float], joints: Sequence[int]) -> Array:
    return np.array([values[joint] for joint in joints])


def _put(values: list[float], joints: Sequence[int], own: ArrayLike) -> None:
    for joint, value in zip(joints, np.asarray(own).tolist(), strict=True):
        values[joint] = value
