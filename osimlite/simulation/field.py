"""All forces of a model at once, as functions written for it.

A `ForceField` knows the joints of a robot in the order of an engine's degrees of freedom, and gives the generalized
forces on them; it also reports forces and energies. It needs no engine: what it reports can be asked for when the
engine is closed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from itertools import pairwise
from types import FunctionType
from typing import Any

import numpy as np

from osimlite.forces import (
    bushing,
    coordinate_limit,
    ellipsoid_contact,
    formulas,
    hunt_crossley,
    smooth_contact,
    springs,
    station_contact,
)
from osimlite.multibody.functions import Constant, Function
from osimlite.multibody.mechanism import GROUND, Mechanism
from osimlite.robot.robot import Robot, RobotJoint
from osimlite.simulation.chain import Chain, Column
from osimlite.simulation.contact_elements import PairContact
from osimlite.simulation.elements import ForceElement, Triple
from osimlite.simulation.script import ZERO, Scalar, Script, Vector, matrix, vector
from osimlite.simulation.states import StateLayout

_MODULES = (
    bushing,
    coordinate_limit,
    ellipsoid_contact,
    formulas,
    hunt_crossley,
    smooth_contact,
    springs,
    station_contact,
)

LAWS: dict[str, Callable[..., Any]] = {
    name: law
    for module in _MODULES
    for name, law in vars(module).items()
    if isinstance(law, FunctionType) and law.__module__ == module.__name__
}
"""What the code of force elements may call, by name."""

TIME = "time"
"""What the code calls the time (s)."""


class Writer:
    """What a force element needs to write itself.

    Attributes:
        script: the code so far.
        chain: where bodies and points are.
        reporting: whether the code is to keep what a report wants, and not to be quick.
    """

    def __init__(self, field: ForceField, script: Script, *, reporting: bool) -> None:
        self.field = field
        self.script = script
        self.chain = field.chain
        self.reporting = reporting
        self.names: dict[str, Any] = {
            **LAWS,
            "powers": field.powers,
            "value_of": value_of,
            "inf": math.inf,
            "nan": math.nan,
            "sin": math.sin,
            "cos": math.cos,
            "sqrt": math.sqrt,
        }
        self._slot = self._contact = 0

    def write(self, elements: Sequence[ForceElement]) -> None:
        """Write all elements, each with its own places for what it keeps."""
        for element in elements:
            element.write(self)
            self._slot += slots(element)
            self._contact += len(element.pairs) if isinstance(element, PairContact) else 0

    def coordinate(self, place: int) -> tuple[Scalar, Scalar]:
        """Value and generalized speed of a coordinate; numbers if it is locked."""
        number = self.field.number_of.get(place)
        if number is None:
            return self.field.mechanism.coordinates[place].default_value, 0.0
        return (f"x{number}", f"u{number}") if self.field.separate else (f"q{number}", f"r{number}")

    def call(self, law: str, *arguments: Scalar, results: int = 1) -> Any:
        """Call a law: the name of its result, or a list of names if there are more."""
        text = f"{law}({', '.join(x if isinstance(x, str) else repr(x) for x in arguments)})"
        if results == 1:
            return self.script.assign(text)
        names = [self.script.fresh() for _ in range(results)]
        self.script.line(f"{', '.join(names)} = {text}")
        return names

    def constant(self, value: Any) -> str:
        """A name for any object."""
        name = f"constant{len(self.names)}"
        self.names[name] = value
        return name

    def evaluate(self, function: Function, argument: Scalar) -> Scalar:
        """The value of a function of one number."""
        if isinstance(function, Constant):
            return function.value
        if not isinstance(argument, str):
            return value_of(function, argument)
        return str(self.script.assign(f"value_of({self.constant(function)}, {argument})"))

    def push(self, columns: Sequence[Column], force: Vector) -> None:
        """Apply a force at the point of some columns, and its opposite at the same point of their base."""
        for column in columns if not self.reporting else ():
            self._add(f"t{column.joint}", self.script.dot(column.moving, force))

    def turn(self, columns: Sequence[Column], torque: Vector) -> None:
        """Apply a torque on the body of some columns, and its opposite on their base."""
        for column in columns if not self.reporting else ():
            self._add(f"t{column.joint}", self.script.dot(column.turning, torque))

    def push_joint(self, joint: int, force: Scalar) -> None:
        """Apply a force on the one axis of a joint."""
        if not self.reporting:
            self._add(f"t{joint}", force)

    def push_coordinate(self, place: int, force: Scalar) -> None:
        """Apply a generalized force, conjugate to the generalized speed, on a coordinate; none if it is locked."""
        if not self.reporting and place in self.field.number_of:
            self._add(f"{'s' if self.field.separate else 't'}{self.field.number_of[place]}", force)

    def keep(self, place: int, *values: Scalar) -> None:
        """Keep some values for the report in one of the element's places."""
        if self.reporting:
            self.script.line(f"kept[{self._slot + place}] = ({', '.join(map(str, values))},)")

    def dissipate(self, state: str, power: Scalar) -> None:
        """Note the derivative (W) of the auxiliary state of a path."""
        if not self.reporting:
            self.script.line(f"powers[{self.field.states.index(state)}] = {power}")

    def touch(self, place: int, force: Vector) -> None:
        """Note that a contact touches, and its force."""
        if not self.reporting:
            number = self._contact + place
            self.script.line(f"touching |= {1 << number}")
            self.script.line(f"loads[{number}] = ({', '.join(map(str, force))})")

    def _add(self, name: str, value: Scalar) -> None:
        if value != 0.0:
            self.script.line(f"{name} += {value}")


class ForceField:
    """The forces of a model on the joints of a robot.

    Args:
        robot: without fixed joints.
        joints: its joints in the order of an engine's joints.
        elements: the forces.
        order: place in the mechanism of each coordinate of the state. If left out, the coordinates of the state are
            those that the values of the joints are, one by one, and the generalized speeds are the rates of the joints.

    Attributes:
        order: place in the mechanism of each coordinate of the state.
        number_of: the number in the state of each coordinate that moves.
        separate: whether the state is told apart from the values and rates of the joints.
        contacts: names of the contacts, by their number.
        state: what a state consists of.
        states: paths of the auxiliary states.
        powers: their derivatives where `generalized` was last called.
    """

    def __init__(
        self,
        robot: Robot,
        joints: Sequence[RobotJoint],
        elements: Sequence[ForceElement],
        order: Sequence[int] | None = None,
    ) -> None:
        self.mechanism: Mechanism = robot.mechanism
        self.chain = Chain(robot, joints)
        self.elements = tuple(elements)
        self.separate = order is not None
        self.order = tuple(own_coordinates(joints) if order is None else order)
        self.state = StateLayout(self.mechanism, self.order, self.elements)
        self.states = self.state.paths
        self.powers = [0.0] * len(self.states)
        self.number_of = {place: number for number, place in enumerate(self.order)}
        self.contacts = tuple(
            element.pair_name(place)
            for element in self.elements
            if isinstance(element, PairContact)
            for place in range(len(element.pairs))
        )

    @cached_property
    def generalized(self) -> Callable[..., tuple[float, ...]]:
        """The function of time, q, r, loads that gives the forces on the n joints at values q and rates r.

        If `separate`, the values x and speeds u of the state come after r, and forces conjugate to the generalized
        speeds follow those on the joints. `loads` is a list: its last entry becomes a number whose bits tell which
        contacts touch, an entry before it becomes the force (N, in ground) on the second surface of a contact that
        does; the others are left as they are.
        """
        script = self._script("generalized", "loads")
        names = [f"t{joint}" for joint in range(len(self.chain.joints))]
        if self.separate:
            names += [f"s{number}" for number in range(len(self.order))]
        if names:
            script.line(f"{' = '.join(names)} = 0.0")
        script.line("touching = 0")
        writer = Writer(self, script, reporting=False)
        writer.write(self.elements)
        script.line("loads[-1] = touching")
        script.line(f"return ({''.join(name + ', ' for name in names)})")
        return script.function(writer.names)

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Labels of the rows that :meth:`records` gives; surfaces on one body have the same ones, and values."""
        return tuple(label for element in self.elements for label in element.columns)

    def records(self, t: float, *state: Sequence[float]) -> list[float]:
        """One row of the forces in effect at a state: q, r, and x, u if `separate`."""
        row: list[float] = []
        for element, values, origins in self._reported(t, *state):
            row += element.record(values, origins)
        return row

    def stored_energy(self, t: float, *state: Sequence[float]) -> float:
        """Potential energy of all force elements, J."""
        return sum(
            float(value[-1]) for _, values, _ in self._reported(t, *state) for value in values if value is not None
        )

    def energies(self, t: float, *state: Sequence[float]) -> tuple[float, float, float]:
        """Kinetic energy, potential energy of gravity, and energy stored in the force elements, J."""
        kinetic, gravity = self._mechanical(t, *state)
        return kinetic, gravity, self.stored_energy(t, *state)

    # --------------------------------------------------------------------------------------------- helpers
    def _script(self, name: str, *more: str) -> Script:
        counts = {"q": len(self.chain.joints), "r": len(self.chain.joints)}
        if self.separate:
            counts |= {"x": len(self.order), "u": len(self.order)}
        script = Script(name, [TIME, *counts, *more])
        for letter, count in counts.items():
            if count:
                script.line(f"{''.join(f'{letter}{number}, ' for number in range(count))}= {letter}")
        return script

    def _reported(self, t: float, *state: Sequence[float]) -> Iterator[tuple[ForceElement, list[Any], list[Triple]]]:
        kept, origins = self._report(t, *state)
        slot = 0
        for element in self.elements:
            yield element, kept[slot : slot + slots(element)], origins
            slot += slots(element)

    @cached_property
    def _report(self) -> Callable[..., Any]:
        script = self._script("report")
        script.line(f"kept = [None] * {sum(map(slots, self.elements))}")
        writer = Writer(self, script, reporting=True)
        places = [self.chain.body(script, body).origin for body in (*range(len(self.mechanism.bodies)), GROUND)]
        writer.write(self.elements)
        script.line(f"return kept, [{', '.join('(' + ', '.join(map(str, place)) + ')' for place in places)}]")
        return script.function(writer.names)

    @cached_property
    def _mechanical(self) -> Callable[..., tuple[float, float]]:
        """Kinetic energy and potential energy of gravity."""
        script, gravity = self._script("mechanical"), vector(self.mechanism.gravity)
        script.line("kinetic = potential = 0.0")
        for index, body in enumerate(self.mechanism.bodies):
            mass = body.mass_properties.mass
            if mass == 0.0:
                continue
            center = self.chain.point(script, index, vector(body.mass_properties.center))
            height = script.dot(gravity, center)
            script.line(f"potential -= {script.sum((mass, height))}")
            columns = self.chain.columns(script, GROUND, index, center)
            v = self.chain.velocity(script, columns)
            turning = self.chain.velocity(script, columns, turning=True)
            rotation = self.chain.body(script, index).rotation
            w = script.combine(*zip(turning, rotation, strict=True)) if turning != ZERO else ZERO
            momentum = script.apply(matrix(body.mass_properties.inertia), w)
            moving, spinning = script.dot(v, v), script.dot(w, momentum)
            script.line(f"kinetic += {script.sum((0.5 * mass, moving), (0.5, spinning))}")
        script.line("return kinetic, potential")
        return script.function({"sin": math.sin, "cos": math.cos})


def value_of(function: Function, argument: float) -> float:
    """The value of a function of one number."""
    value, _, _ = function.evaluate(np.array((argument,)))
    return float(value)


def integral(function: Function, start: float, end: float) -> float:
    """The integral of a function of one number, exact for pieces of polynomials up to the ninth degree.

    By Gauss and Legendre's five points from knot to knot, or in sixteen parts where there are no knots.
    """
    inner = [knot for knot in getattr(function, "x", ()) if min(start, end) < knot < max(start, end)]
    knots = np.unique([start, end, *inner]) if inner else np.linspace(start, end, 17)
    knots = knots if knots[0] == start else knots[::-1]
    nodes, weights = np.polynomial.legendre.leggauss(5)
    total = 0.0
    for left, right in pairwise(knots.tolist()):
        half = 0.5 * (right - left)
        values = [value_of(function, left + half * (1.0 + node)) for node in nodes]
        total += half * float(weights @ values)
    return total


def slots(element: ForceElement) -> int:
    """How many places an element has to keep something for its record."""
    return len(element.pairs) if isinstance(element, PairContact) else 1


def own_coordinates(joints: Sequence[RobotJoint]) -> list[int]:
    """The coordinate that the value of each joint is; fewer than joints if one is another function."""
    return [joint.coordinate for joint in joints if joint.coordinate is not None]
