"""Bushings of all kinds, as force elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from osimlite.multibody.functions import Function
from osimlite.multibody.spatial import Array
from osimlite.schema.springs import BushingForce, ExpressionBasedBushingForce, FunctionBasedBushingForce
from osimlite.simulation.elements import ElementBuilder, Triple, triple
from osimlite.simulation.field import Writer, integral
from osimlite.simulation.formula import Formula
from osimlite.simulation.script import Matrix, Scalar, Vector, matrix
from osimlite.simulation.states import StateVariable

DEVIATIONS = ("theta_x", "theta_y", "theta_z", "delta_x", "delta_y", "delta_z")
FUNCTIONS = (
    "m_x_theta_x_function",
    "m_y_theta_y_function",
    "m_z_theta_z_function",
    "f_x_delta_x_function",
    "f_y_delta_y_function",
    "f_z_delta_z_function",
)

Law = float | Function | Formula
"""Of the load against a deviation: a stiffness, a function of the deviation, or a formula in all of them."""


@dataclass(frozen=True)
class BushingFrame:
    """A frame of a bushing: its name, its body and where it is in the body."""

    name: str
    body: int
    rotation: Matrix
    origin: Triple


@dataclass(frozen=True)
class Bushing:
    """One bushing between two frames.

    Attributes:
        laws: for the six deviations, angles first.
        damping: N.m/(rad/s), N/(m/s).
        about_bodies: whether the torques of the record are about the origins of the bodies instead of the frames.
        states: the energy that the dampers have taken up, if that is one.
    """

    path: str
    name: str
    one: BushingFrame
    two: BushingFrame
    laws: tuple[Law, ...]
    damping: tuple[float, ...]
    about_bodies: bool = False
    states: tuple[StateVariable, ...] = ()

    @classmethod
    def linear(cls, builder: ElementBuilder, force: BushingForce) -> Bushing:
        """The element of a BushingForce."""
        stiffness = *force.rotational_stiffness, *force.translational_stiffness
        builder.check(force, stiffness)
        state = StateVariable(f"{builder.path(force)}/dissipated_energy", is_simbody=True)
        return cls._of(builder, force, stiffness, about_bodies=True, states=(state,))

    @classmethod
    def by_functions(cls, builder: ElementBuilder, force: FunctionBasedBushingForce) -> Bushing:
        """The element of a FunctionBasedBushingForce."""
        return cls._of(builder, force, tuple(builder.function(force, getattr(force, what), what) for what in FUNCTIONS))

    @classmethod
    def by_formulas(cls, builder: ElementBuilder, force: ExpressionBasedBushingForce) -> Bushing:
        """The element of an ExpressionBasedBushingForce; its energy is not known and counts as none."""
        laws = []
        for kind in ("Mx", "My", "Mz", "Fx", "Fy", "Fz"):
            where = f"the {kind}_expression of '{builder.path(force)}'"
            laws.append(Formula.parse(getattr(force, f"{kind}_expression"), DEVIATIONS, where))
        return cls._of(builder, force, tuple(laws))

    @classmethod
    def _of(cls, builder: ElementBuilder, force: Any, laws: tuple[Law, ...], **more: Any) -> Bushing:
        damping = *force.rotational_damping, *force.translational_damping
        builder.check(force, damping)
        frames = []
        for field in ("socket_frame1", "socket_frame2"):
            frame = builder.target(force, field, getattr(force, field))
            body, placed = builder.placement(frame)
            frames.append(BushingFrame(frame.name, body, matrix(placed[:3, :3]), triple(placed[:3, 3])))
        return cls(builder.path(force), force.name, frames[0], frames[1], laws, damping, **more)

    def write(self, writer: Writer) -> None:
        """Write the deviations, their rates, and the load."""
        script, chain = writer.script, writer.chain
        r1 = script.multiply(chain.body(script, self.one.body).rotation, self.one.rotation)
        r2 = script.multiply(chain.body(script, self.two.body).rotation, self.two.rotation)
        start = chain.point(script, self.one.body, self.one.origin)
        end = chain.point(script, self.two.body, self.two.origin)
        gap = script.combine((1.0, end), (-1.0, start))
        to1, to2 = _transposed(r1), _transposed(r2)
        between = script.multiply(to1, r2)
        entries = [between[i][k] for i, k in ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (2, 2))]
        angles = writer.call("xyz_angles", *entries, results=3)
        deviations = [*angles, *script.apply(to1, gap)]
        columns = chain.columns(script, self.one.body, self.two.body, end)
        rates: list[Scalar] = [0.0] * 6
        if any(self.damping):
            turning = script.apply(to2, chain.velocity(script, columns, turning=True))
            rates = writer.call("xyz_rates", angles[1], angles[2], *turning, results=3)
            rates += script.apply(to1, chain.velocity(script, columns))
        loads = [self._load(writer, place, deviations, rates[place]) for place in range(6)]
        moment = script.apply(r2, _triple(writer.call("xyz_moment", angles[1], angles[2], *loads[:3], results=3)))
        force = script.apply(r1, _triple(loads[3:]))
        writer.push(columns, force)
        writer.turn(columns, moment)
        for state in self.states:
            damped = [(rate, c) for rate, c in zip(rates, self.damping, strict=True) if c != 0.0]
            writer.dissipate(state.path, script.sum(*((writer.call("bushing_dissipation", *each),) for each in damped)))
        if writer.reporting:
            writer.keep(0, *force, *moment, *start, *end, self._energy(writer, deviations))

    def _load(self, writer: Writer, place: int, deviations: Sequence[Scalar], rate: Scalar) -> Scalar:
        law, c = self.laws[place], self.damping[place]
        if isinstance(law, float | int):
            load: Scalar = writer.call("bushing_load", deviations[place], rate, float(law), c)
            return load
        if isinstance(law, Formula):
            value = law.write(writer, dict(zip(DEVIATIONS, deviations, strict=True)))
        else:
            value = writer.evaluate(law, deviations[place])
        return writer.script.sum((-1.0, value), (-c, rate))

    def _energy(self, writer: Writer, deviations: Sequence[Scalar]) -> Scalar:
        terms: list[Scalar] = []
        for law, deviation in zip(self.laws, deviations, strict=True):
            if isinstance(law, float | int):
                terms.append(writer.call("spring_energy", deviation, float(law)))
            elif not isinstance(law, Formula):
                name = writer.constant(law)
                terms.append(writer.script.assign(f"{writer.constant(integral)}({name}, 0.0, {deviation})"))
        return writer.script.sum(*((term,) for term in terms))

    @property
    def columns(self) -> tuple[str, ...]:
        """Force and torque on each of the frames."""
        labels = [f"{kind}.{axis}" for kind in ("force", "torque") for axis in "XYZ"]
        return tuple(f"{self.name}.{frame.name}.{label}" for frame in (self.one, self.two) for label in labels)

    def record(self, values: Sequence[Any], origins: Sequence[Triple]) -> list[float]:
        """Forces and torques in ground, about the origins of the frames or of their bodies."""
        (value,) = values
        force, moment, start, end = np.array(value[:12], dtype=float).reshape(4, 3)
        first, second = start, end
        if self.about_bodies:
            first, second = np.array(origins[self.one.body]), np.array(origins[self.two.body])
        row: list[Array] = [
            -force,
            -moment - np.cross(end - first, force),
            force,
            moment + np.cross(end - second, force),
        ]
        return [float(number) for part in row for number in part]


def _transposed(rows: Matrix) -> Matrix:
    x, y, z = zip(*rows, strict=True)
    return x, y, z


def _triple(scalars: Sequence[Scalar]) -> Vector:
    x, y, z = scalars
    return x, y, z
