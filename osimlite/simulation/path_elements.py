"""Springs, ligaments and actuators along a path through points that are fixed in bodies, as force elements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from osimlite.errors import ModelError
from osimlite.multibody.functions import Function
from osimlite.schema.path_actuators import McKibbenActuator, PathActuator
from osimlite.schema.path_forces import Blankevoort1991Ligament, ExpressionBasedPathForce, Ligament, PathSpring
from osimlite.schema.paths import GeometryPath, PathPoint
from osimlite.simulation.controls import Control
from osimlite.simulation.elements import ElementBuilder, Triple, kind_of, triple
from osimlite.simulation.field import Writer, integral
from osimlite.simulation.formula import Formula
from osimlite.simulation.script import Scalar
from osimlite.simulation.spring_elements import Element, Line, rate_of, write_tension

Point = tuple[int, Triple]
"""A body, and a station in it (m)."""


@dataclass(frozen=True)
class PathElement(Element):
    """A force that pulls along a path; a subclass says how strongly.

    Attributes:
        points: of the path, in order.
    """

    points: tuple[Point, ...]
    recorded: ClassVar[tuple[str, ...]] = ()
    """What follows the name in the labels of the record."""

    def write(self, writer: Writer) -> None:
        """Write length, rate and tension, and what the tension pulls."""
        script = writer.script
        lengths: list[Scalar] = []
        parts: dict[int, list[Scalar]] = {}
        for one, two in zip(self.points, self.points[1:], strict=False):
            line = Line.between(writer, one, two)
            lengths.append(line.length)
            for column, by in zip(line.columns, line.lengthening, strict=True):
                parts.setdefault(column.joint, []).append(by)
        length = script.sum(*((item,) for item in lengths))
        lengthening = {joint: script.sum(*((item,) for item in items)) for joint, items in parts.items()}
        tension, energy, record = self.tension(writer, length, rate_of(writer, lengthening))
        write_tension(writer, lengthening, tension)
        if writer.reporting:
            writer.keep(0, *record, energy)

    def tension(self, writer: Writer, length: Scalar, rate: Scalar) -> tuple[Scalar, Scalar, tuple[Scalar, ...]]:
        """Write the tension (N); give the energy (J) and what is recorded, too."""
        raise NotImplementedError

    @property
    def columns(self) -> tuple[str, ...]:
        """What OpenSim records."""
        return tuple(self.name + end for end in self.recorded)


@dataclass(frozen=True)
class PathSpringElement(PathElement):
    """One PathSpring; `constants` are l0, k, d of the law."""

    recorded = ("_tension",)

    constants: Triple

    @classmethod
    def of(cls, builder: ElementBuilder, force: PathSpring) -> PathSpringElement:
        """The element of a force."""
        constants = force.resting_length, force.stiffness, force.dissipation
        builder.check(force, constants)
        return cls(builder.path(force), force.name, path_points(builder, force), constants)

    def tension(self, writer: Writer, length: Scalar, rate: Scalar) -> tuple[Scalar, Scalar, tuple[Scalar, ...]]:
        """As the law has it."""
        l0, k, _ = self.constants
        tension = writer.call("path_spring_tension", length, rate, *self.constants)
        energy = writer.call("path_spring_energy", length, l0, k) if writer.reporting else 0.0
        return tension, energy, (tension,)


@dataclass(frozen=True)
class PathFormula(PathElement):
    """One ExpressionBasedPathForce; its energy is not known and counts as none."""

    recorded = ("_tension",)

    resting_length: float
    clamped: bool
    formula: Formula

    @classmethod
    def of(cls, builder: ElementBuilder, force: ExpressionBasedPathForce) -> PathFormula:
        """The element of a force."""
        builder.check(force, (force.resting_length,))
        path = builder.path(force)
        formula = Formula.parse(force.expression, ("s", "ldot"), f"the expression of '{path}'")
        points = path_points(builder, force)
        return cls(path, force.name, points, force.resting_length, force.clamp_stretch, formula)

    def tension(self, writer: Writer, length: Scalar, rate: Scalar) -> tuple[Scalar, Scalar, tuple[Scalar, ...]]:
        """By the formula, in stretch and lengthening speed."""
        stretch = writer.call("stretch", length, self.resting_length, self.clamped)
        tension = self.formula.write(writer, {"s": stretch, "ldot": rate})
        return tension, 0.0, (tension,)


@dataclass(frozen=True)
class LigamentElement(PathElement):
    """One Ligament: `force` (N) times a curve of the length over the resting length (m)."""

    recorded = ("",)

    resting_length: float
    force: float
    curve: Function

    @classmethod
    def of(cls, builder: ElementBuilder, force: Ligament) -> LigamentElement:
        """The element of a ligament."""
        builder.check(force, (force.resting_length, force.pcsa_force))
        if force.resting_length <= 0.0:
            raise ModelError(f"the resting_length of '{builder.path(force)}' is not positive; give it one that is")
        curve = builder.function(force, force.force_length_curve, "force_length_curve")
        points = path_points(builder, force)
        return cls(builder.path(force), force.name, points, force.resting_length, force.pcsa_force, curve)

    def tension(self, writer: Writer, length: Scalar, rate: Scalar) -> tuple[Scalar, Scalar, tuple[Scalar, ...]]:
        """By the curve beyond the resting length, and none before."""
        script, l0 = writer.script, self.resting_length
        tension, energy = script.assign("0.0"), script.assign("0.0")
        with script.block(f"if {length} > {l0!r}:"):
            ratio = script.assign(f"{length} / {l0!r}")
            script.line(f"{tension} = {script.sum((self.force, writer.evaluate(self.curve, ratio)))}")
            if writer.reporting:
                area = f"{writer.constant(integral)}({writer.constant(self.curve)}, 1.0, {ratio})"
                script.line(f"{energy} = {self.force * l0!r} * {area}")
        return tension, energy, (tension,)


@dataclass(frozen=True)
class Blankevoort(PathElement):
    """One Blankevoort1991Ligament; `constants` are l0, k, e1, c of the law."""

    recorded = (
        ".force_spring",
        ".force_damping",
        ".force_total",
        ".length",
        ".lengthening_speed",
        ".strain",
        ".strain_rate",
    )

    constants: tuple[float, float, float, float]

    @classmethod
    def of(cls, builder: ElementBuilder, force: Blankevoort1991Ligament) -> Blankevoort:
        """The element of a ligament."""
        constants = force.slack_length, force.linear_stiffness, force.transition_strain, force.damping_coefficient
        builder.check(force, constants)
        if force.slack_length <= 0.0:
            raise ModelError(f"the slack_length of '{builder.path(force)}' is not positive; give it one that is")
        return cls(builder.path(force), force.name, path_points(builder, force), constants)

    def tension(self, writer: Writer, length: Scalar, rate: Scalar) -> tuple[Scalar, Scalar, tuple[Scalar, ...]]:
        """As the law has it."""
        l0, k, e1, _ = self.constants
        tension: Scalar = writer.call("blankevoort_tension", length, rate, *self.constants)
        if not writer.reporting:
            return tension, 0.0, ()
        elastic: Scalar = writer.call("blankevoort_tension", length, 0.0, *self.constants)
        damping = writer.script.sum((tension,), (-1.0, elastic))
        strain = writer.script.sum((1.0 / l0, length), (-1.0,))
        energy: Scalar = writer.call("blankevoort_energy", length, l0, k, e1)
        strain_rate = writer.script.sum((1.0 / l0, rate))
        return tension, energy, (elastic, damping, tension, length, rate, strain, strain_rate)


@dataclass(frozen=True)
class PathDrive(PathElement):
    """One PathActuator, which pulls with its control."""

    recorded = ("",)

    control: Control

    @classmethod
    def of(cls, builder: ElementBuilder, force: PathActuator) -> PathDrive:
        """The element of an actuator."""
        control = Control.of(builder, force)
        return cls(builder.path(force), force.name, path_points(builder, force), control)

    def tension(self, writer: Writer, length: Scalar, rate: Scalar) -> tuple[Scalar, Scalar, tuple[Scalar, ...]]:
        """The control times the optimal force."""
        tension = self.control.write(writer)
        return tension, 0.0, (tension,)


@dataclass(frozen=True)
class McKibben(PathElement):
    """One McKibbenActuator, whose control is a pressure; `constants` are n, B, l0 of the law."""

    recorded = ("",)

    control: Control
    constants: Triple

    @classmethod
    def of(cls, builder: ElementBuilder, force: McKibbenActuator) -> McKibben:
        """The element of an actuator."""
        constants = force.number_of_turns, force.thread_length, force.cord_length
        builder.check(force, constants)
        if force.number_of_turns == 0.0:
            raise ModelError(f"the number_of_turns of '{builder.path(force)}' is 0; give it some")
        pressure = replace(Control.of(builder, force), optimal_force=1.0)
        return cls(builder.path(force), force.name, path_points(builder, force), pressure, constants)

    def tension(self, writer: Writer, length: Scalar, rate: Scalar) -> tuple[Scalar, Scalar, tuple[Scalar, ...]]:
        """As the law has it."""
        tension: Scalar = writer.call("mckibben_tension", length, self.control.write(writer), *self.constants)
        return tension, 0.0, (tension,)


def path_points(builder: ElementBuilder, force: Any) -> tuple[Point, ...]:
    """The points of a force's path.

    Raises:
        UnsupportedError: a point moves or comes and goes, or the path wraps around a surface.
        ModelError: there are less than two points.
    """
    path = force.geometry_path
    if type(path) is not GeometryPath:
        raise builder.unsupported(force, f" on a {kind_of(path)}")
    if path.path_wrap_set.objects:
        raise builder.unsupported(force, f" that wraps around '{_wrapped(path)}'")
    found = []
    for point in path.path_point_set.objects:
        if type(point) is not PathPoint:
            raise builder.unsupported(force, f" with the {kind_of(point)} '{point.name}'")
        body, placed = builder.placement(builder.target(point, "socket_parent_frame", point.socket_parent_frame))
        builder.check(point, point.location)
        found.append((body, triple(placed[:3, :3] @ point.location + placed[:3, 3])))
    if len(found) < 2:
        raise ModelError(f"the path of '{builder.path(force)}' has {len(found)} points; give it at least two")
    return tuple(found)


def _wrapped(path: GeometryPath) -> str:
    named = path.path_wrap_set.objects[0].wrap_object
    return named if isinstance(named, str) else named.name


PATH_MAKERS: dict[type, Callable[[ElementBuilder, Any], PathElement]] = {
    Blankevoort1991Ligament: Blankevoort.of,
    ExpressionBasedPathForce: PathFormula.of,
    Ligament: LigamentElement.of,
    McKibbenActuator: McKibben.of,
    PathActuator: PathDrive.of,
    PathSpring: PathSpringElement.of,
}
