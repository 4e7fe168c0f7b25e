"""Formulas at one point of the grid, from which goals and constraints are made."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, field, replace
from osimlite.derivatives.symbols import casadi
from osimlite.mechanics.multibody.spatial import Array

if TYPE_CHECKING:
    from osimlite.optimal.problem import Problem
    from osimlite.schema.moco.path_constraints import MocoFrameDistanceConstraint
    from osimlite.schema.moco.tracking import MocoContactTrackingGoal

Formula = Any
"""CasADi ``SX`` expression."""


@dataclass(frozen=True, eq=False)
class TimeFunction:
    """Function of time that is known in advance, such as a measured angle.

    Attributes:
        number: index among the functions of the problem.
        values: function of times (n,) that returns value, first and second derivative (3, n).
        factor: index of the parameter that multiplies it; None for no parameter.
    """

    number: int
    values: Callable[[Array], Array]
    factor: int | None = None

    def expand(self, t: Formula, time_data: Formula) -> Formula:
        """Return the value by a Taylor expansion about the time ``time_data[0]``.

        The expansion is renewed for each time, so that value and both derivatives are exact there.

        Args:
            t: time, s.
            time_data: data of the functions of time, see :class:`PointSymbols`.
        """
        first_datum = 1 + 3 * self.number
        time_difference = t - time_data[0]
        return time_data[first_datum] + time_difference * (
            time_data[first_datum + 1] + 0.5 * time_difference * time_data[first_datum + 2]
        )


class FrameSymbols(NamedTuple):
    """Pose and velocity of a frame in ground.

    Attributes:
        position: position of the origin (3, 1), m.
        rotation: rotation matrix from the frame to ground (3, 3).
        velocity: velocity of the origin (3, 1), m/s.
        angular_velocity: angular velocity (3, 1), rad/s.
    """

    position: Formula
    rotation: Formula
    velocity: Formula
    angular_velocity: Formula


@dataclass(eq=False)
class PointSymbols:
    """Symbols of the variables at one time of the motion, and formulas of them.

    Attributes:
        problem: optimal control problem.
        t: time, s, followed by the time-dependent loads of the model (`problem.functions.loads`).
        x: complete state (n, 1) in the order of `problem.functions.states`.
        u: controls (m, 1) in the order of `problem.functions.controls`; 0 for actuators that do not
            act.
        multipliers: multipliers of the model's constraints (c, 1).
        derivatives: accelerations and rates of auxiliary states that are variables; empty if
            explicit.
        slacks: velocity corrections or projection slacks, if the point has them.
        p: values of the model's parameters, one for each number of the model.
        parameters: parameters of the problem; each may stand for several of `p`.
        time_data: data of the functions of time: the time of the expansion, and value, first and second
            derivative of each function there.
        projections: values and speeds at the end of the interval before they are projected onto the
            constraints, if the point has them.
        linear_systems: pairs of symbols and linear equations with a symmetric matrix that determine
            them: accelerations.
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
    time_data: Formula
    projections: Formula = field(default_factory=lambda: casadi.SX(0, 1))
    linear_systems: list[tuple[Formula, Formula]] = field(default_factory=list)
    _outputs: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def before_projection(self) -> PointSymbols:
        """Return the same point with the values and speeds before projection; itself without projections."""
        size = self.projections.numel()
        x = casadi.vertcat(self.projections, self.x[size:])
        # The copy shares `linear_systems`, to which its own accelerations are added.
        return replace(self, x=x, _outputs={}) if size else self

    def state(self, path: str) -> Formula:
        """Return the state with a path such as ``/jointset/knee/knee_angle/value``."""
        return self.x[self.problem.functions.states.index(path)]

    def control(self, path: str) -> Formula:
        """Return the control with the path of its actuator."""
        return self.u[self.problem.functions.controls.index(path)]

    def evaluate(self, series: TimeFunction) -> Formula:
        """Return the value of a function of time at this point."""
        value = series.expand(self.t[0], self.time_data)
        return value if series.factor is None else self.parameters[series.factor] * value

    @cached_property
    def rates(self) -> Formula:
        """Return the time derivative of the complete state (n, 1) by the dynamics of the problem."""
        return self.problem.dynamics.compute_rates(self)

    @property
    def accelerations(self) -> Formula:
        """Return the accelerations (k, 1) in the order of `problem.functions.coordinates`, m/s² or rad/s²."""
        size = len(self.problem.functions.coordinates)
        return self.rates[size : 2 * size]

    def output(self, name: str) -> dict[str, Formula]:
        """Return a group of outputs of the model.

        Args:
            name: name of a result of ``functions.outputs``.

        Returns:
            Formula of each output by its label.
        """
        functions = self.problem.functions
        # All outputs come from one call, whose results are cached for further goals.
        if not self._outputs:
            values = functions.outputs(self.t, self.x, self.u, self.p)
            values = values if isinstance(values, tuple) else (values,)
            self._outputs.update(zip(functions.outputs.name_out(), values, strict=True))
        labels = functions.output_names[name]
        return {label: self._outputs[name][index] for index, label in enumerate(labels)}

    def frame(self, path: str) -> FrameSymbols:
        """Return the pose and velocity of a frame of the model by its path."""
        outputs = self.problem.functions.frames([path])(self.t, self.x, self.p)
        # Each frame is a column of nine numbers, the rotation matrix column by column.
        return FrameSymbols(outputs[0], casadi.reshape(outputs[1], 3, 3), *outputs[2:])

    def acceleration(self, frame: FrameSymbols) -> Formula:
        """Return the acceleration of the origin of a frame in ground (3, 1), m/s²."""
        # The velocity depends on time by the state alone, so that the chain rule gives its rate.
        return casadi.jtimes(frame.velocity, self.x, self.rates)

    def mass_center(self) -> Formula:
        """Return the position of the model's mass centre in ground (3,), m."""
        return casadi.vertcat(*self.output("mass_center").values())


@dataclass(frozen=True, eq=False)
class Endpoints:
    """Arguments of the value of a goal.

    Attributes:
        start: first point.
        end: last point.
        integral: integral of the goal's integrand over time; None without an integrand.
    """

    start: PointSymbols
    end: PointSymbols
    integral: Formula | None

    @property
    def duration(self) -> Formula:
        """Duration of the motion, s."""
        return self.end.t[0] - self.start.t[0]


COST_ONLY = ("cost",)
"""Modes of a goal that can only be a cost."""
COST_FIRST = "cost", "endpoint_constraint"
"""Modes of a goal that is a cost by default."""
CONSTRAINT_FIRST = "endpoint_constraint", "cost"
"""Modes of a goal that is an endpoint constraint by default."""


@dataclass(frozen=True, eq=False)
class GoalTerms:
    """Terms of one goal as formulas.

    As a cost, a goal with several values counts by their sum; a goal that is a constraint by
    default by the sum of their squares.

    Attributes:
        value: function of both ends and the integral that returns the value or the column of
            values.
        integrand: function of a point whose integral `value` needs; None for a goal without
            integral.
        modes: modes that the goal can have, its default first: COST_ONLY, COST_FIRST,
            CONSTRAINT_FIRST.
        is_sum: whether the integrand is summed over all points instead of integrated.
    """

    value: Callable[[Endpoints], Formula]
    integrand: Callable[[PointSymbols], Formula] | None = None
    modes: tuple[str, ...] = COST_ONLY
    is_sum: bool = False


@dataclass(frozen=True, eq=False)
class ConstraintRows:
    """Rows of one path constraint as formulas.

    Attributes:
        labels: names of the values, for messages.
        formula: function of a point that returns the column of values (k, 1).
        limits: lower and upper bound of each value.
    """

    labels: list[str]
    formula: Callable[[PointSymbols], Formula]
    limits: list[tuple[float, float]]


def make_integral_terms(
    integrand: Callable[[PointSymbols], Formula], modes: tuple[str, ...] = COST_ONLY
) -> GoalTerms:
    """Return the terms of a goal that is the integral of an integrand over time.

    Args:
        integrand: function of a point that returns a number.
        modes: modes of the goal, its default first.
    """
    return GoalTerms(lambda ends: ends.integral, integrand, modes)


def make_projection(
    owner: MocoContactTrackingGoal | MocoFrameDistanceConstraint, problem: Problem
) -> Callable[[Formula], Formula]:
    """Return the function that projects vectors in ground (3, 1) by the property ``projection``.

    Args:
        owner: goal or constraint with the property.
        problem: problem of the study, for messages.

    Returns:
        Projection onto the line of ``projection_vector`` or onto the plane normal to it; the
        identity for "none".

    Raises:
        DocumentError: the projection has no direction.
    """
    if owner.projection == "none":
        return lambda vector: vector
    if owner.projection_vector is None or not any(owner.projection_vector):
        raise problem.invalid_error(owner, "projection requires a nonzero projection_vector")
    direction = casadi.DM(
        np.array(owner.projection_vector) / np.linalg.norm(owner.projection_vector)
    )

    def project(vector: Formula) -> Formula:
        on_line = casadi.dot(vector, direction) * direction
        return on_line if owner.projection == "vector" else vector - on_line

    return project


def compute_projection_distance(point: PointSymbols) -> Formula:
    """Return the squared distance by which states are projected at a point; zero at points without one."""
    return casadi.sumsqr(point.projections - point.x[: point.projections.numel()])


def sum_scaled_squares(
    selection: str | slice, scaling: tuple[float, float], point: PointSymbols
) -> Formula:
    """Return the sum of squares of scaled multipliers or derivatives that are variables.

    Args:
        selection: "multipliers", or the slice of the derivatives.
        scaling: factor and offset of the scaling.
        point: point of the grid.
    """
    column = point.multipliers if isinstance(selection, str) else point.derivatives[selection]
    return casadi.sumsqr((column - scaling[1]) / scaling[0])
