"""Actuators, whose controls are functions of time, and prescribed forces, as force elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from osimlite.errors import ModelError
from osimlite.multibody.functions import Function
from osimlite.multibody.mechanism import GROUND
from osimlite.schema.actuators import (
    BodyActuator,
    CoordinateActuator,
    PointActuator,
    PointToPointActuator,
    TorqueActuator,
)
from osimlite.schema.prescribed import PrescribedForce
from osimlite.simulation.controls import Control, controllers
from osimlite.simulation.elements import ElementBuilder, Triple, triple
from osimlite.simulation.field import TIME, Writer
from osimlite.simulation.script import ZERO, Matrix, Scalar, Vector, matrix
from osimlite.simulation.spring_elements import Element

STILL: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class ScalarActuatorElement(Element):
    """An actuator with one control."""

    control: Control

    @property
    def columns(self) -> tuple[str, ...]:
        """Its force or torque."""
        return (self.name,)


@dataclass(frozen=True)
class CoordinateDrive(ScalarActuatorElement):
    """One CoordinateActuator."""

    coordinate: int

    @classmethod
    def of(cls, builder: ElementBuilder, force: CoordinateActuator) -> CoordinateDrive:
        """The element of an actuator."""
        return cls(builder.path(force), force.name, Control.of(builder, force), builder.coordinate(force))

    def write(self, writer: Writer) -> None:
        """Write the generalized force."""
        value = self.control.write(writer)
        writer.push_coordinate(self.coordinate, value)
        writer.keep(0, value, 0.0)


@dataclass(frozen=True)
class TorqueDrive(ScalarActuatorElement):
    """One TorqueActuator: a torque about `axis` (a unit vector of ground or of the first body) on the first body."""

    bodies: tuple[int, int]
    axis: Triple
    in_ground: bool

    @classmethod
    def of(cls, builder: ElementBuilder, force: TorqueActuator) -> TorqueDrive:
        """The element of an actuator."""
        one, two = (
            builder.placement(builder.target(force, field, getattr(force, field))) for field in ("bodyA", "bodyB")
        )
        axis = _unit(builder, force, force.axis)
        if not force.torque_is_global:
            axis = triple(one[1][:3, :3] @ axis)
        control = Control.of(builder, force)
        bodies = one.body, two.body
        return cls(builder.path(force), force.name, control, bodies, axis, force.torque_is_global)

    def write(self, writer: Writer) -> None:
        """Write the torque."""
        script, (one, two) = writer.script, self.bodies
        value = self.control.write(writer)
        if value != 0.0:
            axis: Vector = self.axis if self.in_ground else writer.chain.direction(script, one, self.axis)
            writer.turn(writer.chain.columns(script, two, one, ZERO), script.combine((value, axis)))
        writer.keep(0, value, 0.0)


@dataclass(frozen=True)
class PointDrive(ScalarActuatorElement):
    """One PointActuator: a force along a unit vector at a point (m), each fixed in ground or in the body."""

    body: int
    point: Triple
    point_in_ground: bool
    direction: Triple
    direction_in_ground: bool

    @classmethod
    def of(cls, builder: ElementBuilder, force: PointActuator) -> PointDrive:
        """The element of an actuator."""
        body = builder.placement(builder.target(force, "body", force.body)).body
        builder.check(force, force.point)
        return cls(
            builder.path(force),
            force.name,
            Control.of(builder, force),
            body,
            triple(force.point),
            force.point_is_global,
            _unit(builder, force, force.direction),
            force.force_is_global,
        )

    def write(self, writer: Writer) -> None:
        """Write the force."""
        script, chain = writer.script, writer.chain
        value = self.control.write(writer)
        if value != 0.0:
            point: Vector = self.point if self.point_in_ground else chain.point(script, self.body, self.point)
            along: Vector = self.direction
            if not self.direction_in_ground:
                along = chain.direction(script, self.body, self.direction)
            writer.push(chain.columns(script, GROUND, self.body, point), script.combine((value, along)))
        writer.keep(0, value, 0.0)


@dataclass(frozen=True)
class PointToPointDrive(ScalarActuatorElement):
    """One PointToPointActuator: pushes two points (m) apart that are fixed in ground or in the bodies."""

    bodies: tuple[int, int]
    points: tuple[Triple, Triple]
    in_ground: bool

    @classmethod
    def of(cls, builder: ElementBuilder, force: PointToPointActuator) -> PointToPointDrive:
        """The element of an actuator."""
        one, two = (
            builder.placement(builder.target(force, field, getattr(force, field))).body for field in ("bodyA", "bodyB")
        )
        builder.check(force, (*force.pointA, *force.pointB))
        points = triple(force.pointA), triple(force.pointB)
        control = Control.of(builder, force)
        return cls(builder.path(force), force.name, control, (one, two), points, force.points_are_global)

    def write(self, writer: Writer) -> None:
        """Write the force."""
        script, chain = writer.script, writer.chain
        value = self.control.write(writer)
        if value != 0.0:
            one, two = (
                point if self.in_ground else chain.point(script, body, point)
                for body, point in zip(self.bodies, self.points, strict=True)
            )
            gap = script.combine((1.0, one), (-1.0, two))
            length = script.assign(f"sqrt({script.dot(gap, gap)})")
            size = script.assign(f"{value} / {length} if {length} > 0.0 else 0.0")
            columns = chain.columns(script, self.bodies[1], self.bodies[0], one)
            writer.push(columns, script.combine((size, gap)))
        writer.keep(0, value, 0.0)


@dataclass(frozen=True)
class IdleActuator(Element):
    """One BodyActuator that nothing drives, so that it does nothing."""

    @classmethod
    def of(cls, builder: ElementBuilder, force: BodyActuator) -> IdleActuator:
        """The element of an actuator.

        Raises:
            UnsupportedError: something drives it. A PrescribedController has one function for the six controls, and
                OpenSim 4.6 takes the other five from whatever is in memory.
        """
        for controller in controllers(builder):
            named = (builder.target(controller, "socket_actuators", item) for item in controller.socket_actuators)
            if any(item is force for item in named):
                raise builder.unsupported(force, f" driven by '{builder.path(controller)}'")
        return cls(builder.path(force), force.name)

    def write(self, writer: Writer) -> None:
        """Write nothing but that there is no energy."""
        writer.keep(0, 0.0)

    @property
    def columns(self) -> tuple[str, ...]:
        """OpenSim records nothing."""
        return ()


@dataclass(frozen=True)
class Prescribed(Element):
    """One PrescribedForce: a force at a point, and a torque, as functions of time.

    Attributes:
        body: that they act on.
        frame: name of the frame in the model.
        rotation: of the frame in the body.
        origin: of the frame in the body, m.
        force: three functions (N), or none; `point` (m) and `torque` (N.m) likewise.
    """

    body: int
    frame: str
    rotation: Matrix
    origin: Triple
    point_in_ground: bool
    force_in_ground: bool
    force: tuple[Function, ...]
    point: tuple[Function, ...]
    torque: tuple[Function, ...]

    @classmethod
    def of(cls, builder: ElementBuilder, force: PrescribedForce) -> Prescribed:
        """The element of a force; other than three functions count as none, as in OpenSim."""
        frame = builder.target(force, "socket_frame", force.socket_frame)
        body, placed = builder.placement(frame)
        given = []
        for what in ("forceFunctions", "pointFunctions", "torqueFunctions"):
            functions = getattr(force, what).objects
            given.append(tuple(builder.function(force, item, what) for item in functions if len(functions) == 3))
        return cls(
            builder.path(force),
            force.name,
            body,
            frame.name,
            matrix(placed[:3, :3]),
            triple(placed[:3, 3]),
            force.pointIsGlobal,
            force.forceIsGlobal,
            *given,
        )

    def write(self, writer: Writer) -> None:
        """Write the force and the torque."""
        script, chain = writer.script, writer.chain
        row: list[Scalar] = []
        body = chain.body(script, self.body)
        turned = STILL
        if not (self.force_in_ground and self.point_in_ground):
            turned = script.multiply(body.rotation, self.rotation)
        start = chain.point(script, self.body, self.origin)
        if self.force:
            force = self._vector(writer, self.force)
            if not self.force_in_ground:
                force = script.apply(turned, force)
            row += force
            point = start
            if self.point:
                given = point = self._vector(writer, self.point)
                if not self.point_in_ground:
                    point = script.combine((1.0, start), (1.0, script.apply(turned, given)))
                elif writer.reporting:
                    # What is recorded is the point in the frame in either case.
                    turned = script.multiply(body.rotation, self.rotation)
                    arm = script.combine((1.0, point), (-1.0, start))
                    given = script.combine(*zip(arm, turned, strict=True))
                row += given
            writer.push(chain.columns(script, GROUND, self.body, point), force)
        if self.torque:
            torque = self._vector(writer, self.torque)
            if not self.force_in_ground:
                torque = script.apply(script.multiply(body.rotation, self.rotation), torque)
            row += torque
            writer.turn(chain.columns(script, GROUND, self.body, ZERO), torque)
        writer.keep(0, *row, 0.0)

    @staticmethod
    def _vector(writer: Writer, functions: Sequence[Function]) -> Vector:
        x, y, z = (writer.evaluate(function, TIME) for function in functions)
        return x, y, z

    @property
    def columns(self) -> tuple[str, ...]:
        """Force and torque in ground, and the point in the frame."""
        start = f"{'ground' if self.force_in_ground else self.frame}_{self.name}"
        labels: list[str] = []
        if self.force:
            labels += (f"{start}_f{axis}" for axis in "xyz")
        if self.force and self.point:
            labels += (f"{start}_p{axis}" for axis in "xyz")
        if self.torque:
            labels += (f"{start}_torque_{axis}" for axis in "xyz")
        return tuple(labels)


def _unit(builder: ElementBuilder, force: Any, direction: Sequence[float]) -> Triple:
    builder.check(force, direction)
    size = float(np.linalg.norm(direction))
    if size == 0.0:
        raise ModelError(f"'{builder.path(force)}' has a direction of length 0; give it one")
    return triple(np.array(direction) / size)
