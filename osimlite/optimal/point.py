"""Formulas at one point of the grid: what goals and constraints are made of."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from osimlite.base.records import dataclass, field, replace
from osimlite.derivatives.symbols import casadi
from osimlite.mechanics.multibody.spatial import Array

if TYPE_CHECKING:
    from osimlite.optimal.problem import Problem
    from osimlite.schema.moco.path_constraints import MocoFrameDistanceConstraint
    from osimlite.schema.moco.tracking import MocoContactTrackingGoal

Formula = Any
"""An ``SX`` of CasADi."""


@dataclass(frozen=True, eq=False)
class TimeFunction:
    """A function of time that is given, such as a measured angle.

    Attributes: number: among those of the problem. values: at times (n,) the value and both of its
        derivatives (3, n). factor: place among the parameters of the problem of the one that it is
        multiplied by; None if by none.
    """

    number: int
    values: Callable[[Array], Array]
    factor: int | None = None

    def expand(self, t: Formula, known: Formula) -> Formula:
        """The value; exact to the second derivative, as what is known is renewed for each time."""
        first, since = 1 + 3 * self.number, t - known[0]
        return known[first] + since * (known[first + 1] + 0.5 * since * known[first + 2])


class Frame(NamedTuple):
    """Where a frame is in ground, and how it moves."""

    position: Formula  # (3, 1), m
    rotation: Formula  # (3, 3)
    velocity: Formula  # of its origin (3, 1), m/s
    angular_velocity: Formula  # (3, 1), rad/s


@dataclass(eq=False)
class Point:
    """Symbols, and what follows from them, at one moment of the motion.

    Attributes: problem: that is solved. t: time, s, and behind it the loads of the model
        (`problem.functions.loads`). x: the whole state in the order of `problem.functions.states`,
        what is prescribed included. u: controls, in the order of `problem.functions.controls`.
        multipliers: of the model's constraints. derivatives: that are variables: accelerations, and
        rates of auxiliary states; empty if explicit. slacks: of velocity corrections or
        projections, if the point has them. p: parameters, one for each number of the model that
        they stand for. parameters: as the problem has them. known: what the series are made of: the
        time that they are expanded about, and three numbers for each. projections: values and
        speeds that the interval leads to, before they are moved onto the constraints, if the point
        has them. solved: symbols in the formulas for what linear equations with a symmetric matrix
        determine, each with what is zero then: accelerations.
    """

    problem: Problem
    t: Formula
    x: Formula
    u: Formula
    multipliers: Formula
    derivatives: Formula
    slacks: Formula
    p: Formula
    parameters: Formula
    known: Formula
    projections: Formula = field(default_factory=lambda: casadi.SX(0, 1))
    linear_systems: list[tuple[Formula, Formula]] = field(default_factory=list)
    _kept: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def before_projection(self) -> Point:
        """The same with the values and speeds that the interval leads to."""
        size = self.projections.numel()
        x = casadi.vertcat(self.projections, self.x[size:])
        return replace(self, x=x, _kept={}) if size else self

    def state(self, path: str) -> Formula:
        """The state of a path."""
        return self.x[self.problem.functions.states.index(path)]

    def control(self, path: str) -> Formula:
        """The control of a path."""
        return self.u[self.problem.functions.controls.index(path)]

    def evaluate(self, series: TimeFunction) -> Formula:
        """What a series is at this time."""
        value = series.expand(self.t[0], self.known)
        return value if series.factor is None else self.parameters[series.factor] * value

    @cached_property
    def rates(self) -> Formula:
        """The derivative of the whole state, of which speeds and accelerations are those of the dynamics mode."""
        return self.problem.dynamics.compute_rates(self)

    @property
    def accelerations(self) -> Formula:
        """Of the coordinates, in the order of `problem.functions.coordinates`."""
        size = len(self.problem.functions.coordinates)
        return self.rates[size : 2 * size]

    def output(self, name: str) -> dict[str, Formula]:
        """What is computed of the model under one of the names of ``functions.outputs``, by its labels."""
        functions = self.problem.functions
        if not self._kept:
            values = functions.outputs(self.t, self.x, self.u, self.p)
            values = values if isinstance(values, tuple) else (values,)
            self._kept.update(zip(functions.outputs.name_out(), values, strict=True))
        labels = functions.output_names[name]
        return {label: self._kept[name][place] for place, label in enumerate(labels)}

    def frame(self, path: str) -> Frame:
        """A frame of the model."""
        found = self.problem.functions.frames([path])(self.t, self.x, self.p)
        return Frame(found[0], casadi.reshape(found[1], 3, 3), *found[2:])

    def acceleration(self, frame: Frame) -> Formula:
        """Of the origin of a frame (3, 1), m/s²."""
        return casadi.jtimes(frame.velocity, self.x, self.rates)

    def mass_center(self) -> Formula:
        """Of the whole model in ground (3,), m."""
        return casadi.vertcat(*self.output("mass_center").values())


@dataclass(frozen=True, eq=False)
class Endpoints:
    """What the value of a goal is made of.

    Attributes:
        start: the first point.
        end: the last one.
        integral: of the goal's integrand over time; None if it has none.
    """

    start: Point
    end: Point
    integral: Formula | None

    @property
    def duration(self) -> Formula:
        """S."""
        return self.end.t[0] - self.start.t[0]


COST_ONLY = ("cost",)
COST_FIRST = "cost", "endpoint_constraint"
CONSTRAINT_FIRST = "endpoint_constraint", "cost"


@dataclass(frozen=True, eq=False)
class GoalTerms:
    """What a goal consists of.

    Attributes: value: from both ends, and from the integral over time, the value or the column of
        values of the goal. integrand: at a point; None if nothing is integrated. modes: that the
        goal can have, first the one that it has where the study says nothing: COST, BOTH,
        CONSTRAINT. The cost of a goal that is a constraint first is the sum of the squares of its
        values, of others the sum. is_sum: whether the integrand is added up over all points in the
        place of being integrated.
    """

    value: Callable[[Endpoints], Formula]
    integrand: Callable[[Point], Formula] | None = None
    modes: tuple[str, ...] = COST_ONLY
    is_sum: bool = False


@dataclass(frozen=True, eq=False)
class ConstraintRows:
    """What a path constraint consists of.

    Attributes:
        labels: of its values, for messages.
        formula: at a point, the column of its values.
        limits: least and greatest of each value.
    """

    labels: list[str]
    formula: Callable[[Point], Formula]
    limits: list[tuple[float, float]]


def make_integral_terms(
    integrand: Callable[[Point], Formula], modes: tuple[str, ...] = COST_ONLY
) -> GoalTerms:
    """The terms of a goal that is the integral of something over time."""
    return GoalTerms(lambda ends: ends.integral, integrand, modes)


def make_projection(
    part: MocoContactTrackingGoal | MocoFrameDistanceConstraint, problem: Problem
) -> Callable[[Formula], Formula]:
    """Return the function that projects vectors in ground (3, 1) as the property ``projection`` says.

    Args:
        part: goal or constraint with the property.
        problem: problem of the study, for messages.

    Returns:
        Projection onto the line of ``projection_vector`` or onto the plane normal to it; the
        identity for "none".

    Raises:
        DocumentError: the projection has no direction.
    """
    if part.projection == "none":
        return lambda vector: vector
    if part.projection_vector is None or not any(part.projection_vector):
        raise problem.invalid_error(part, "a projection needs a projection_vector")
    direction = casadi.DM(np.array(part.projection_vector) / np.linalg.norm(part.projection_vector))

    def project(vector: Formula) -> Formula:
        on_line = casadi.dot(vector, direction) * direction
        return on_line if part.projection == "vector" else vector - on_line

    return project
