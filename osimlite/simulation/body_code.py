"""How a few bodies of a robot move, as straight-line code.

Constraints look at one or two bodies each. The code follows the joints from ground to these bodies only, and gives what
:class:`osimlite.multibody.kinematics.Kinematics` would hold of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from osimlite.multibody.kinematics import Kinematics
from osimlite.multibody.mechanism import GROUND
from osimlite.multibody.spatial import Array
from osimlite.simulation.chain import Chain
from osimlite.simulation.reduction import Reduced
from osimlite.simulation.script import ZERO, Scalar, Script, Vector


class _Motion(NamedTuple):
    """Of a frame in ground: a point of it, its velocity and acceleration, and those of turning."""

    point: Vector
    v: Vector
    a: Vector
    w: Vector
    alpha: Vector

    def at(self, script: Script, point: Vector) -> _Motion:
        """The same frame, seen at another point of it."""
        arm = script.combine((1.0, point), (-1.0, self.point))
        turning = script.cross(self.w, arm)
        v = script.combine((1.0, self.v), (1.0, turning))
        a = script.combine((1.0, self.a), (1.0, script.cross(self.alpha, arm)), (1.0, script.cross(self.w, turning)))
        return _Motion(point, v, a, self.w, self.alpha)


class BodyStates:
    """What some bodies do at a state of the joints.

    Args:
        chain: of the robot.
        bodies: indices of the bodies in the mechanism.
        order: place in the mechanism of each coordinate of the state.
    """

    def __init__(self, chain: Chain, bodies: Sequence[int], order: Sequence[int]) -> None:
        mechanism = chain.robot.mechanism
        self._mechanism = mechanism
        self._order = np.array(order, dtype=int)
        self._bodies = [body for body in dict.fromkeys(bodies) if body != GROUND]
        self._paths = [list(chain.path(body)) for body in self._bodies]
        count, size = len(mechanism.bodies), len(mechanism.coordinates)
        # What is not written for a body is never looked at; ground, the last, is at rest.
        self._rotations, self._origins = np.zeros((count + 1, 3, 3)), np.zeros((count + 1, 3))
        self._rotations[-1] = np.eye(3)
        self._jacobians = np.zeros((count + 1, 6, size))
        self._velocities, self._biases = np.zeros((count + 1, 6)), np.zeros((count + 1, 6))
        script = Script("bodies", ["q", "r", "b"])
        joints = range(len(chain.joints))
        for letter in "qrb" if chain.joints else "":
            script.line(f"{''.join(f'{letter}{joint}, ' for joint in joints)}= {letter}")
        found: list[Scalar] = []
        for body in self._bodies:
            found += _written(script, chain, body)
        script.line(f"return ({''.join(f'{scalar}, ' for scalar in found)})")
        self._code = script.function()

    def at(self, t: float, q: Array, u: Array, joints: Reduced) -> Kinematics:
        """The mechanism with these bodies, at values q and speeds u of all coordinates; valid until the next call."""
        numbers = np.array(self._code(joints.values.tolist(), joints.rates.tolist(), joints.bias.tolist()))
        start = 0
        for body, path in zip(self._bodies, self._paths, strict=True):
            end = start + 24 + 6 * len(path)
            own = numbers[start:end]
            self._rotations[body] = own[:9].reshape(3, 3)
            self._origins[body] = own[9:12]
            self._velocities[body] = own[12:18]
            self._biases[body] = own[18:24]
            if path:
                self._jacobians[body][:, self._order] = own[24:].reshape(-1, 6).T @ joints.jacobian[path]
            start = end
        return Kinematics(
            self._mechanism, q, u, self._rotations, self._origins, self._jacobians, self._velocities, self._biases, t
        )


def _written(script: Script, chain: Chain, body: int) -> list[Scalar]:
    """Rotation, origin, velocity, bias and, joint by joint, the columns of the Jacobian of a body."""
    placed, path = chain.body(script, body), chain.path(body)
    motion = _carried(script, chain, path[-1]) if path else _REST
    motion = motion.at(script, placed.origin)
    found: list[Scalar] = [scalar for row in placed.rotation for scalar in row]
    for vector in (placed.origin, motion.w, motion.v, motion.alpha, motion.a):
        found += vector
    columns = {column.joint: column for column in chain.columns(script, GROUND, body, placed.origin)}
    for joint in path:
        found += (*columns[joint].turning, *columns[joint].moving)
    return found


_REST = _Motion(ZERO, ZERO, ZERO, ZERO, ZERO)


def _carried(script: Script, chain: Chain, joint: int) -> _Motion:
    """What the link does that a joint moves, while all udot are zero."""

    def make() -> _Motion:
        below = chain.parent(joint)
        before = _REST if below < 0 else _carried(script, chain, below)
        axis, anchor = chain.axis(script, joint)
        rate, bias = script.combine((f"r{joint}", axis)), script.combine((f"b{joint}", axis))
        across = script.cross(before.w, rate)
        if chain.joints[joint].kind == "prismatic":
            moved = before.at(script, script.combine((1.0, anchor), (f"q{joint}", axis)))
            v = script.combine((1.0, moved.v), (1.0, rate))
            return moved._replace(v=v, a=script.combine((1.0, moved.a), (2.0, across), (1.0, bias)))
        moved = before.at(script, anchor)
        w = script.combine((1.0, before.w), (1.0, rate))
        return moved._replace(w=w, alpha=script.combine((1.0, before.alpha), (1.0, across), (1.0, bias)))

    motion: _Motion = script.once(("motion", joint), make)
    return motion
