"""Robot in its own Bullet world, configured to obey mechanics only.

Bullet is made for games. Each change that it needs to compute mechanics is one method or constant
here, as are the properties of the URDF file that make Bullet read it correctly.
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
from osimlite.simulation.robot.robot import Robot, RobotJoint, RobotLink, principal_axes
from osimlite.simulation.robot.urdf import urdf_text

__all__ = ["World", "bullet", "mute_output"]


@contextmanager
def mute_output(descriptor: int = 2) -> Iterator[None]:
    """Discard standard error or output within a block; PyBullet prints its build there.

    Args:
        descriptor: 2 for standard error, 1 for standard output.
    """
    # PyBullet prints from C, so that only the descriptor can be redirected.
    try:
        saved_descriptor = os.dup(descriptor)
    except OSError:
        # Programs without standard error have nothing to mute.
        yield
        return
    null_device = os.open(os.devnull, os.O_WRONLY)
    (sys.stderr if descriptor == 2 else sys.stdout).flush()
    os.dup2(null_device, descriptor)
    try:
        yield
    finally:
        os.dup2(saved_descriptor, descriptor)
        os.close(saved_descriptor)
        os.close(null_device)


with mute_output():
    require(
        "pybullet",
        extra="bullet",
        purpose="the PyBullet engine",
        alternative="the compiled engine, whose motions osimlite view shows",
    )
    import pybullet as bullet

UNLIMITED_SPEED = 1e9
"""Joint speed (rad/s, m/s) that no motion reaches."""


class World:
    """Robot in its own Bullet world, configured to obey mechanics only.

    Args:
        robot: the robot.
        gravity: gravity (3,), m/s².
        files: mesh files that the robot names.
        exact: whether inertias that no real body has are set after loading.

    Attributes:
        client: Bullet's number of the world.
        id: Bullet's number of the robot.
        joints: joints of the robot in the order of Bullet's degrees of freedom.
        impossible: names of links whose inertia no real body has.
    """

    # Without this flag Bullet derives inertias from collision shapes, which are missing here. The
    # flag for sleeping stays off.
    FLAGS = bullet.URDF_USE_INERTIA_FROM_FILE

    DAMPING = 0.0
    """Damping of every link; Bullet's default is 0.04."""

    FASTEST = UNLIMITED_SPEED
    """Limit of joint speeds; Bullet's default is 100."""

    def __init__(
        self,
        robot: Robot,
        gravity: Sequence[float],
        *,
        files: Mapping[str, bytes] | None = None,
        exact: bool = True,
    ) -> None:
        self.client = _connect()
        # Bullet has few worlds, so the garbage collector closes those that users forget.
        self._leave = weakref.finalize(self, bullet.disconnect, self.client)
        self._step = 0.0
        self._exact = exact
        try:
            self._load_robot(robot, gravity, files or {})
        # A world that could not be loaded must not stay open: Bullet has a limit of worlds.
        except BaseException:
            self.close()
            raise

    def _load_robot(
        self, robot: Robot, gravity: Sequence[float], files: Mapping[str, bytes]
    ) -> None:
        client = self.client
        bullet.setGravity(*gravity, physicsClientId=client)
        bullet.setPhysicsEngineParameter(numSubSteps=0, physicsClientId=client)
        self.impossible = [link.name for link in robot.links if compute_inertia_excess(link) > 0.0]
        with write_temporary_file(write_robot(robot), files) as path:
            self.id = bullet.loadURDF(
                path, useFixedBase=1, flags=self.FLAGS, physicsClientId=client
            )
        infos = [
            bullet.getJointInfo(self.id, index, client)
            for index in range(bullet.getNumJoints(self.id, client))
        ]
        self.joints = self.sort_joints(robot, infos)
        self._indices = [int(info[0]) for info in infos if info[3] >= 0]
        self._remove_damping(infos)
        if self.impossible and self._exact:
            self.set_inertias(robot, infos)

    @staticmethod
    def sort_joints(robot: Robot, infos: Sequence[Sequence[Any]]) -> list[RobotJoint]:
        """Return the joints in Bullet's order, which differs from that of the model and of the robot.

        Args:
            robot: the robot.
            infos: Bullet's descriptions of its joints.
        """
        joints = {joint.name: joint for joint in robot.moving}
        return [joints[info[1].decode()] for info in infos if info[3] >= 0]

    def _remove_damping(self, infos: Sequence[Sequence[Any]]) -> None:
        """Remove everything that slows a joint down: damping, speed limits and motors."""
        client = self.client
        # -1 is the base.
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
        """Switch off the motor with which Bullet starts every joint."""
        # Motors have a maximum force, which 0 disables.
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
        """Set the inertias that Bullet refuses to read; only its articulated-body algorithm uses them."""
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
        """Set values and rates of the joints, and update all links.

        Args:
            q: values of the joints, rad or m.
            rates: rates of the joints, rad/s or m/s.
        """
        bullet.resetJointStatesMultiDof(
            self.id, self._indices, [(x,) for x in q], [(x,) for x in rates], self.client
        )

    def get_state(self) -> tuple[list[float], list[float]]:
        """Read the state of the joints.

        Returns:
            Values and rates of the joints.
        """
        states = self._read_joint_states()
        return [state[0] for state in states], [state[1] for state in states]

    def _read_joint_states(self) -> Sequence[Sequence[Any]]:
        """Return Bullet's state of each joint: value, rate, and others."""
        # Bullet returns None for no joints, which all models with only locked coordinates have.
        return bullet.getJointStates(self.id, self._indices, self.client) or ()

    def step(self, h: float, forces: Sequence[float]) -> None:
        """Take one of Bullet's steps.

        Args:
            h: length of the step, s.
            forces: forces on the joints (N or N m), which act during this step only.
        """
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
        """Return the second derivatives of the joint values.

        They are the change of the rates in a step of one second.

        Args:
            q: values of the joints, rad or m.
            rates: rates of the joints, rad/s or m/s.
            forces: forces on the joints, N or N m.
        """
        # A step of 1 s from these rates changes them by the acceleration (semi-implicit Euler).
        self.set_state(q, rates)
        self.step(1.0, forces)
        states = self._read_joint_states()
        return [state[1] - rate for state, rate in zip(states, rates, strict=True)]

    def close(self) -> None:
        """Close the world; may be called repeatedly."""
        if self.client >= 0:
            self._leave()
            self.client = -1


def _connect() -> int:
    client = int(bullet.connect(bullet.DIRECT))
    if client < 0:
        raise SimulationError(
            "Bullet cannot open another simulation; close engines that you no longer need"
        )
    return client


def write_robot(robot: Robot) -> str:
    """Return the robot as URDF, with inertias that Bullet does not replace by zero."""
    links = [
        replace(link, inertia=link.inertia + compute_inertia_excess(link) * np.eye(3))
        if compute_inertia_excess(link) > 0.0
        else link
        for link in robot.links
    ]
    return urdf_text(replace(robot, links=tuple(links)), visuals=True)


def compute_inertia_excess(link: RobotLink) -> float:
    """Return the number to add to the moments of inertia so that Bullet accepts them.

    Bullet replaces moments by zero that violate the triangle inequality or are negative.

    Args:
        link: the link.

    Returns:
        Moment that makes all principal moments valid (kg·m²); 0 if they are.
    """
    moments = [float(moment) for moment in principal_axes(link.inertia)[0]]
    low, middle, high = sorted(moments)
    if low < 0.0:
        # Bullet accepts positive moments if the largest is at most the sum of the others: high +
        # excess <= low + middle + 2 excess. Twice the least such number leaves room for Bullet's
        # rounding.
        return 2.0 * sum(map(abs, moments))
    # With `high` added to all three, the largest is at most the sum of the others: 2 high <= low +
    # middle + 2 high.
    return high if high > low + middle else 0.0


def require_masses(robot: Robot) -> None:
    """Check that the last link of each chain has mass; without one its joint has no defined motion.

    Raises:
        SimulationError: a last link has no mass.
    """
    carriers = {joint.parent for joint in robot.joints}
    links = {link.name: link for link in robot.links}
    for joint in robot.joints:
        if joint.child not in carriers and links[joint.child].mass == 0.0:
            body = next(iter(links[joint.child].bodies), joint.child)
            raise SimulationError(
                f"the body '{body}' and the bodies attached to it have no mass, so the motion of the joint "
                f"'{joint.source}' is undetermined; give the body mass and inertia, or lock the coordinates of the joint"
            )


@contextmanager
def write_temporary_file(text: str, files: Mapping[str, bytes]) -> Iterator[str]:
    """Write a URDF file with its mesh files into a temporary folder.

    Args:
        text: text of the URDF file.
        files: contents of the mesh files by their paths relative to it.

    Yields:
        Path of the URDF file; the folder is deleted afterwards.
    """
    with tempfile.TemporaryDirectory(prefix="osimlite-") as folder:
        for name, content in {"robot.urdf": text.encode(), **files}.items():
            path = Path(folder, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        yield str(Path(folder, "robot.urdf"))
