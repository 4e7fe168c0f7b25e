"""A robot alone in a Bullet world of its own, set up so that it obeys mechanics and nothing else.

Bullet is made for games; what has to be changed so that it computes mechanics is here, one method
or constant for each.
"""

from __future__ import annotations

import os
import sys
import tempfile
import weakref
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.records import replace
from osimlite.base.require import require
from osimlite.errors import SimulationError
from osimlite.simulation.robot.robot import Link, Robot, RobotJoint, principal_axes
from osimlite.simulation.robot.urdf import urdf_text

__all__ = ["World", "bullet", "muted"]


@contextmanager
def muted(descriptor: int = 2) -> Iterator[None]:
    """Nothing goes to standard error (2) or output (1) meanwhile, where PyBullet tells of its build, and more."""
    try:
        kept = os.dup(descriptor)
    except OSError:
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    (sys.stderr if descriptor == 2 else sys.stdout).flush()
    os.dup2(nowhere, descriptor)
    try:
        yield
    finally:
        os.dup2(kept, descriptor)
        os.close(kept)
        os.close(nowhere)


with muted():
    require(
        "pybullet",
        extra="bullet",
        purpose="the PyBullet engine",
        instead="--engine compiled, whose motions osimlite view shows",
    )
    import pybullet as bullet

NO_LIMIT = 1e9


class World:
    """One robot alone in a Bullet world of its own, set up so that it obeys mechanics and nothing else.

    Attributes:
        client: Bullet's number of the world.
        id: Bullet's number of the robot.
        joints: the robot's joints in the order of Bullet's degrees of freedom.
        impossible: names of links whose inertia no real body has.
    """

    # Without this flag Bullet makes up inertias from collision shapes, of which there are none.
    # Sleeping stays off.
    FLAGS = bullet.URDF_USE_INERTIA_FROM_FILE

    DAMPING = 0.0
    """Bullet's default is 0.04, in every link."""

    FASTEST = NO_LIMIT
    """Bullet clips joint speeds at 100 by default."""

    def __init__(
        self,
        robot: Robot,
        gravity: Sequence[float],
        *,
        files: Mapping[str, bytes] | None = None,
        exact: bool = True,
    ) -> None:
        self.client = _connect()
        # Worlds are few: who forgets to close one leaves it to the garbage collector.
        self._leave = weakref.finalize(self, bullet.disconnect, self.client)
        self._step = 0.0
        self._exact = exact
        try:
            self._load(robot, gravity, files or {})
        except BaseException:
            self.close()
            raise

    def _load(self, robot: Robot, gravity: Sequence[float], files: Mapping[str, bytes]) -> None:
        client = self.client
        bullet.setGravity(*gravity, physicsClientId=client)
        bullet.setPhysicsEngineParameter(numSubSteps=0, physicsClientId=client)
        self.impossible = [link.name for link in robot.links if excess(link) > 0.0]
        with temporary_file(robot_text(robot), files) as path:
            self.id = bullet.loadURDF(
                path, useFixedBase=1, flags=self.FLAGS, physicsClientId=client
            )
        infos = [
            bullet.getJointInfo(self.id, index, client)
            for index in range(bullet.getNumJoints(self.id, client))
        ]
        self.joints = self.sort_joints(robot, infos)
        self._indices = [int(info[0]) for info in infos if info[3] >= 0]
        self._release(infos)
        if self.impossible and self._exact:
            self.set_inertias(robot, infos)

    @staticmethod
    def sort_joints(robot: Robot, infos: Sequence[Sequence[Any]]) -> list[RobotJoint]:
        """The joints in Bullet's order, which is not that of the model nor of the robot."""
        joints = {joint.name: joint for joint in robot.moving}
        return [joints[info[1].decode()] for info in infos if info[3] >= 0]

    def _release(self, infos: Sequence[Sequence[Any]]) -> None:
        """Take away everything that slows a joint down."""
        client = self.client
        for index in (-1, *(int(info[0]) for info in infos)):
            bullet.changeDynamics(
                self.id,
                index,
                linearDamping=self.DAMPING,
                angularDamping=self.DAMPING,
                jointDamping=self.DAMPING,
                maxJointVelocity=self.FASTEST,
                physicsClientId=client,
            )
        self.switch_motors_off()

    def switch_motors_off(self) -> None:
        """Bullet starts every joint with a motor that holds it."""
        if self._indices:
            none = [0.0] * len(self._indices)
            bullet.setJointMotorControlArray(
                self.id,
                self._indices,
                bullet.VELOCITY_CONTROL,
                forces=none,
                physicsClientId=self.client,
            )

    def set_inertias(self, robot: Robot, infos: Sequence[Sequence[Any]]) -> None:
        """Give Bullet the inertias that it refuses to read; only its articulated-body algorithm takes them."""
        links = {link.name: link for link in robot.links}
        for info in infos:
            link = links[info[12].decode()]
            if link.name in self.impossible:
                moments, _ = principal_axes(link.inertia)
                bullet.changeDynamics(
                    self.id,
                    int(info[0]),
                    localInertiaDiagonal=[float(moment) for moment in moments],
                    physicsClientId=self.client,
                )

    def set_state(self, q: Sequence[float], rates: Sequence[float]) -> None:
        """Put the joints into a state, and all links where they then are."""
        bullet.resetJointStatesMultiDof(
            self.id, self._indices, [(x,) for x in q], [(x,) for x in rates], self.client
        )

    def get_state(self) -> tuple[list[float], list[float]]:
        """Values and rates of the joints."""
        states = bullet.getJointStates(self.id, self._indices, self.client)
        return [state[0] for state in states], [state[1] for state in states]

    def step(self, h: float, forces: Sequence[float]) -> None:
        """Let Bullet take one step of length h (s) under forces on the joints, which hold for this step only."""
        client = self.client
        if h != self._step:
            bullet.setTimeStep(h, client)
            self._step = h
        bullet.setJointMotorControlArray(
            self.id, self._indices, bullet.TORQUE_CONTROL, forces=forces, physicsClientId=client
        )
        bullet.stepSimulation(client)

    def accelerations_by_step(
        self, q: list[float], rates: list[float], forces: Sequence[float]
    ) -> list[float]:
        """Second derivatives of the joint values: what one second changes the rates by."""
        self.set_state(q, rates)
        self.step(1.0, forces)
        states = bullet.getJointStates(self.id, self._indices, self.client)
        return [state[1] - rate for state, rate in zip(states, rates, strict=True)]

    def close(self) -> None:
        """Leave the world."""
        if self.client >= 0:
            self._leave()
            self.client = -1


def _connect() -> int:
    client = int(bullet.connect(bullet.DIRECT))
    if client < 0:
        raise SimulationError(
            "Bullet opens no more worlds; close the engines that are not needed any more"
        )
    return client


def robot_text(robot: Robot) -> str:
    """The robot as URDF, with inertias that Bullet does not set to zero."""
    links = [
        replace(link, inertia=link.inertia + excess(link) * np.eye(3))
        if excess(link) > 0.0
        else link
        for link in robot.links
    ]
    return urdf_text(replace(robot, links=tuple(links)), visuals=True)


def excess(link: Link) -> float:
    """What to add to each principal moment of inertia so that Bullet does not set them to zero; 0 if they are fine."""
    moments = [float(moment) for moment in principal_axes(link.inertia)[0]]
    low, middle, high = sorted(moments)
    return high if high > low + middle or low < 0.0 else 0.0


def require_masses(robot: Robot) -> None:
    """SimulationError if the last link of a chain has no mass: nothing decides how its joint moves."""
    carriers = {joint.parent for joint in robot.joints}
    links = {link.name: link for link in robot.links}
    for joint in robot.joints:
        if joint.child not in carriers and links[joint.child].mass == 0.0:
            body = next(iter(links[joint.child].bodies), joint.child)
            raise SimulationError(
                f"the body '{body}' has no mass and carries none, so that nothing decides how the joint "
                f"'{joint.source}' moves; give it mass and inertia, or lock the coordinates of the joint"
            )


@contextmanager
def temporary_file(text: str, files: Mapping[str, bytes]) -> Iterator[str]:
    """A URDF file with the mesh files that it names beside it."""
    with tempfile.TemporaryDirectory(prefix="osimlite-") as folder:
        for name, content in {"robot.urdf": text.encode(), **files}.items():
            path = Path(folder, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        yield str(Path(folder, "robot.urdf"))
