"""Springs and formulas on a coordinate and along the line between two points, as force elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from osimlite.schema.springs import (
    ExpressionBasedCoordinateForce,
    ExpressionBasedPointToPointForce,
    PointToPointSpring,
    SpringGeneralizedForce,
)
from osimlite.simulation.chain import Column
from osimlite.simulation.elements import ElementBuilder, Triple, triple
from osimlite.simulation.field import Writer
from osimlite.simulation.formula import Formula
from osimlite.simulation.script import Scalar, Vector


@dataclass(frozen=True)
class Element:
    """A force element whose code keeps its record as it is, and the energy (J) after it."""

    path: str
    name: str

    def record(self, values: Sequence[Any], origins: Sequence[Triple]) -> list[float]:
        """What the code kept, but for the energy."""
        (value,) = values
        return [float(number) for number in value[:-1]]


@dataclass(frozen=True)
class CoordinateSpring(Element):
    """One SpringGeneralizedForce; `constants` are k, q0, c of the law."""

    coordinate: int
    constants: Triple

    @classmethod
    def of(cls, builder: ElementBuilder, force: SpringGeneralizedForce) -> CoordinateSpring:
        """The element of a force."""
        constants = force.stiffness, force.rest_length, force.viscosity
        builder.check(force, constants)
        return cls(builder.path(force), force.name, builder.coordinate(force), constants)

    def write(self, writer: Writer) -> None:
        """Write the force on the coordinate."""
        q, u = writer.coordinate(self.coordinate)
        k, q0, _ = self.constants
        value = writer.call("coordinate_spring_force", q, u, *self.constants)
        writer.push_coordinate(self.coordinate, value)
        if writer.reporting:
            writer.keep(0, value, writer.call("spring_energy", writer.script.sum((q,), (-1.0, q0)), k))

    @property
    def columns(self) -> tuple[str, ...]:
        """The generalized force."""
        return (f"{self.name}_Force",)


@dataclass(frozen=True)
class CoordinateFormula(Element):
    """One ExpressionBasedCoordinateForce; its energy is not known and counts as none."""

    coordinate: int
    formula: Formula

    @classmethod
    def of(cls, builder: ElementBuilder, force: ExpressionBasedCoordinateForce) -> CoordinateFormula:
        """The element of a force."""
        path = builder.path(force)
        formula = Formula.parse(force.expression, ("q", "qdot"), f"the expression of '{path}'")
        return cls(path, force.name, builder.coordinate(force), formula)

    def write(self, writer: Writer) -> None:
        """Write the force on the coordinate."""
        q, u = writer.coordinate(self.coordinate)
        value = self.formula.write(writer, {"q": q, "qdot": u})
        writer.push_coordinate(self.coordinate, value)
        writer.keep(0, value, 0.0)

    @property
    def columns(self) -> tuple[str, ...]:
        """The generalized force."""
        return (self.name,)


class Line(NamedTuple):
    """The straight line from a point of one body to a point of another, in the code.

    Attributes:
        along: unit vector from the first point to the second (zero where they are one).
        length: m.
        columns: motion of the second body relative to the first.
        lengthening: of the line by a unit rate of the joint of each column.
    """

    start: Vector
    end: Vector
    along: Vector
    length: Scalar
    columns: Sequence[Column]
    lengthening: Sequence[Scalar]

    @classmethod
    def between(cls, writer: Writer, one: tuple[int, Vector], two: tuple[int, Vector]) -> Line:
        """Write a line; the points are bodies, and stations in them."""
        script = writer.script
        start, end = writer.chain.point(script, *one), writer.chain.point(script, *two)
        gap = script.combine((1.0, end), (-1.0, start))
        length = script.assign(f"sqrt({script.dot(gap, gap)})")
        inverse = script.assign(f"1.0 / {length} if {length} > 0.0 else 0.0")
        along = script.combine((inverse, gap))
        # A turning of the first body moves its own point across the line only.
        columns = writer.chain.columns(script, one[0], two[0], end)
        return cls(start, end, along, length, columns, [script.dot(column.moving, along) for column in columns])


def write_tension(writer: Writer, lengthening: dict[int, Scalar], tension: Scalar) -> None:
    """Pull with a tension; `lengthening` is by joint."""
    for joint, by in lengthening.items():
        writer.push_joint(joint, writer.script.sum((-1.0, tension, by)))


def rate_of(writer: Writer, lengthening: dict[int, Scalar]) -> Scalar:
    """Rate of a length, m/s."""
    return writer.script.sum(*((f"r{joint}", by) for joint, by in lengthening.items()))


@dataclass(frozen=True)
class PointSpring(Element):
    """One PointToPointSpring, or a formula in its place.

    OpenSim takes the points as stations of the base bodies, also where the springs name other frames; the points that
    it records are those of the frames.

    Attributes:
        frames: names of the frames in the record.
        bodies: the two bodies.
        points: stations in them, m.
        recorded: stations in them that are recorded, m.
        law: k and l0, or the formula in d and ddot.
    """

    frames: tuple[str, str]
    bodies: tuple[int, int]
    points: tuple[Triple, Triple]
    recorded: tuple[Triple, Triple]
    law: tuple[float, float] | Formula

    @classmethod
    def of(cls, builder: ElementBuilder, force: PointToPointSpring) -> PointSpring:
        """The element of a spring."""
        builder.check(force, (*force.point1, *force.point2, force.stiffness, force.rest_length))
        return cls._of(builder, force, ("socket_body1", "socket_body2"), (force.stiffness, force.rest_length))

    @classmethod
    def of_formula(cls, builder: ElementBuilder, force: ExpressionBasedPointToPointForce) -> PointSpring:
        """The element of a formula; its energy is not known and counts as none."""
        builder.check(force, (*force.point1, *force.point2))
        where = f"the expression of '{builder.path(force)}'"
        return cls._of(builder, force, ("body1", "body2"), Formula.parse(force.expression, ("d", "ddot"), where))

    @classmethod
    def _of(
        cls, builder: ElementBuilder, force: Any, fields: tuple[str, str], law: tuple[float, float] | Formula
    ) -> PointSpring:
        frames = [builder.target(force, field, getattr(force, field)) for field in fields]
        points = force.point1, force.point2
        placed = [builder.placement(frame) for frame in frames]
        one, two = (
            triple(frame[:3, :3] @ point + frame[:3, 3]) for (_, frame), point in zip(placed, points, strict=True)
        )
        texts = [getattr(force, field) for field in fields]
        if fields[0] == "body1":
            names = [text if isinstance(text, str) else text.name for text in texts]
        else:
            names = [frame.name for frame in frames]
        return cls(
            builder.path(force),
            force.name,
            (names[0], names[1]),
            (placed[0].body, placed[1].body),
            (triple(points[0]), triple(points[1])),
            (one, two),
            law,
        )

    def write(self, writer: Writer) -> None:
        """Write the tension, and what it pulls."""
        script = writer.script
        ends = tuple(zip(self.bodies, self.points, strict=True))
        line = Line.between(writer, ends[0], ends[1])
        lengthening = {column.joint: by for column, by in zip(line.columns, line.lengthening, strict=True)}
        if isinstance(self.law, Formula):
            # A formula is positive where it pulls, as a tension is.
            variables = {"d": line.length, "ddot": rate_of(writer, lengthening)}
            tension = self.law.write(writer, variables)
        else:
            tension = writer.call("point_spring_tension", line.length, *self.law)
        write_tension(writer, lengthening, tension)
        if writer.reporting:
            one = script.combine((tension, line.along))
            two = script.combine((-1.0, one))
            start, end = (writer.chain.point(script, *end) for end in zip(self.bodies, self.recorded, strict=True))
            energy: Scalar = 0.0
            if not isinstance(self.law, Formula):
                k, l0 = self.law
                energy = writer.call("spring_energy", script.sum((line.length,), (-1.0, l0)), k)
            writer.keep(0, *one, *start, *two, *end, energy)

    @property
    def columns(self) -> tuple[str, ...]:
        """Force and point in ground, for each of the frames."""
        labels = [f"{what}.{axis}" for what in ("force", "point") for axis in "XYZ"]
        return tuple(f"{self.name}.{frame}.{label}" for frame in self.frames for label in labels)
