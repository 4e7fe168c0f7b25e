"""Goals that track the pose and motion of frames: position, orientation, angular velocity, acceleration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from osimlite.base.records import dataclass
from osimlite.derivatives.symbols import casadi
from osimlite.errors import DocumentError
from osimlite.io.tables.headers import list_suffixes
from osimlite.io.tables.storage import StoTable, read_sto
from osimlite.mechanics.multibody.spatial import Array, quaternion_of
from osimlite.optimal.point import (
    Formula,
    FrameSymbols,
    GoalTerms,
    PointSymbols,
    make_integral_terms,
)
from osimlite.optimal.tables import fit_splines, read_reference
from osimlite.schema.base import Component
from osimlite.schema.moco.goals import MocoGoal
from osimlite.schema.moco.parts import MocoWeightSet
from osimlite.schema.moco.tracking import (
    MocoAccelerationTrackingGoal,
    MocoAngularVelocityTrackingGoal,
    MocoOrientationTrackingGoal,
    MocoTranslationTrackingGoal,
)
from osimlite.schema.tools.processors import TableProcessor

if TYPE_CHECKING:
    from osimlite.optimal.problem import Problem

SMALL_SQUARED_SINE = 1e-8
"""Squared sine below which the squared angle is a power series: the square root has no slope at zero."""


def build_translation_tracking_goal(
    goal: MocoTranslationTrackingGoal, problem: Problem
) -> GoalTerms:
    """Return the integral of the weighted squared distances of frame origins from their references, m² s.

    Args:
        goal: goal of the study.
        problem: problem with the frames.
    """
    reference = FrameReference(
        goal,
        goal.translation_reference_file,
        goal.states_reference,
        goal.frame_paths,
        goal.translation_weights,
        "Vec3",
        "position",
    )
    return reference.build_terms(
        problem, lambda point, frame, target: casadi.sumsqr(frame.position - target)
    )


def build_orientation_tracking_goal(
    goal: MocoOrientationTrackingGoal, problem: Problem
) -> GoalTerms:
    """Return the integral of the weighted squared angles of frames from reference orientations, rad² s.

    Args:
        goal: goal of the study.
        problem: problem with the frames.
    """
    reference = FrameReference(
        goal,
        goal.rotation_reference_file,
        goal.states_reference,
        goal.frame_paths,
        goal.rotation_weights,
        "Quaternion",
        "rotation",
    )
    return reference.build_terms(problem, compute_squared_angle)


def build_angular_velocity_tracking_goal(
    goal: MocoAngularVelocityTrackingGoal, problem: Problem
) -> GoalTerms:
    """Return the integral of the weighted squared errors of angular velocities of frames, rad²/s.

    Args:
        goal: goal of the study.
        problem: problem with the frames.
    """
    reference = FrameReference(
        goal,
        goal.angular_velocity_reference_file,
        goal.states_reference,
        goal.frame_paths,
        goal.angular_velocity_weights,
        "Vec3",
        "angular_velocity",
    )
    return reference.build_terms(
        problem, lambda point, frame, target: casadi.sumsqr(frame.angular_velocity - target)
    )


def build_acceleration_tracking_goal(
    goal: MocoAccelerationTrackingGoal, problem: Problem
) -> GoalTerms:
    """Return the integral of the weighted squared errors of accelerations of frame origins, m²/s³.

    With `gravity_offset` the acceleration is the specific force that an accelerometer measures.

    Args:
        goal: goal of the study.
        problem: problem with the frames.
    """
    gravity = casadi.DM(problem.functions.mechanism.gravity)

    def error(point: PointSymbols, frame: FrameSymbols, target: Formula) -> Formula:
        acceleration = point.acceleration(frame)
        if goal.gravity_offset:
            acceleration -= gravity
        if goal.express_accelerations_in_tracking_frames:
            acceleration = frame.rotation.T @ acceleration
        return casadi.sumsqr(acceleration - target)

    reference = FrameReference(
        goal,
        goal.acceleration_reference_file,
        None,
        goal.frame_paths,
        goal.acceleration_weights,
        "Vec3",
    )
    return reference.build_terms(problem, error)


def compute_squared_angle(point: PointSymbols, frame: FrameSymbols, quaternion: Formula) -> Formula:
    """Return the squared angle, rad², between a frame and an orientation.

    The angle of the relative rotation R follows from its trace, ``1 + 2 cos``, and its skew part,
    whose entries have the squared length ``4 sin²``.

    Args:
        point: point of the grid.
        frame: frame of the model.
        quaternion: orientation in ground, scalar first, of any length.
    """
    w, x, y, z = casadi.vertsplit(quaternion / casadi.norm_2(quaternion))
    target = casadi.horzcat(
        casadi.vertcat(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
        casadi.vertcat(2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
        casadi.vertcat(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)),
    )
    # Rotation of the reference relative to the frame.
    relative_rotation = frame.rotation.T @ target
    cosine = (casadi.trace(relative_rotation) - 1) / 2
    square = (
        (relative_rotation[2, 1] - relative_rotation[1, 2]) ** 2
        + (relative_rotation[0, 2] - relative_rotation[2, 0]) ** 2
        + (relative_rotation[1, 0] - relative_rotation[0, 1]) ** 2
    ) / 4
    angle = casadi.atan2(
        casadi.sqrt(casadi.fmax(square, SMALL_SQUARED_SINE * SMALL_SQUARED_SINE)), cosine
    )
    is_small = casadi.logic_and(square < SMALL_SQUARED_SINE, cosine > 0)
    # Series of asin(s)² for small s².
    return casadi.if_else(is_small, square + square**2 / 3 + 8 * square**3 / 45, angle**2)


@dataclass(frozen=True, eq=False)
class FrameReference:
    """Reference that frames of the model track: a file of values, or a motion that gives them.

    Attributes:
        goal: goal with the reference.
        file: file with a column for each frame; empty to use `states`.
        states: motion of the model from which the values are computed without a file; None where
            OpenSim's goal has no such property.
        paths: paths of the frames.
        weights: weights by path; 1 by default.
        kind: type of the values as the header of the file names it.
        part: field of the result of ``functions.frames`` that is tracked.
    """

    goal: MocoGoal
    file: str
    states: TableProcessor | None
    paths: Sequence[str | Component]
    weights: MocoWeightSet
    kind: str
    part: str = ""

    def build_terms(
        self, problem: Problem, error: Callable[[PointSymbols, FrameSymbols, Formula], Formula]
    ) -> GoalTerms:
        """Return the integral of the weighted sum of errors of the frames.

        Args:
            problem: problem with the frames.
            error: function of a point, a frame and the reference value (k, 1) that returns the
                error.

        Raises:
            DocumentError: the model has no such frames, or the reference lacks them.
        """
        paths = [str(path) for path in self.paths]
        goal = self.goal
        for path in paths:
            problem.check_name(goal, path, problem.functions.mechanism.frames, "frame")
        if not paths:
            raise problem.invalid_error(goal, "frame_paths is empty; OpenSim rejects this too")
        table = self._read_table(problem, paths)
        endings = list_suffixes(self.kind)
        size = len(endings)
        series = fit_splines(problem, table, [f"{path}{end}" for path in paths for end in endings])
        weight_by_path = {weight.name: weight.weight for weight in self.weights.objects}

        def integrand(point: PointSymbols) -> Formula:
            total = casadi.SX(0.0)
            for number, path in enumerate(paths):
                first_series = size * number
                target = [
                    point.evaluate(component_series)
                    for component_series in series[first_series : first_series + size]
                ]
                total += weight_by_path.get(path, 1.0) * error(
                    point, point.frame(path), casadi.vertcat(*target)
                )
            return total

        return make_integral_terms(integrand)

    def _read_table(self, problem: Problem, paths: Sequence[str]) -> StoTable:
        """Return the table of reference values, from the file or from the motion.

        Args:
            problem: problem with the frames.
            paths: paths of the frames.

        Raises:
            DocumentError: the table holds other quantities than the goal tracks.
        """
        goal = self.goal
        endings = list_suffixes(self.kind)
        if self.file.strip():
            if self.states is not None and self.states.filepath.strip():
                raise problem.invalid_error(
                    goal, "it has a reference file and a states_reference; remove one"
                )
            table = read_sto(problem.locate_file(self.file))
            if table.kind != self.kind:
                message = f"the table holds {table.kind}, not {self.kind}; its header must say DataType={self.kind}"
                raise DocumentError(message, file=table.file)
            columns = table.columns[:: len(endings)]
            column_paths = [column.removesuffix(endings[0]) for column in columns]
            if unlisted_paths := [path for path in column_paths if path not in paths]:
                # OpenSim 4.6 takes all columns of the file, whatever frame_paths says.
                message = f"frame_paths leaves out '{unlisted_paths[0]}' of {self.file}, which OpenSim tracks nevertheless"
                raise problem.invalid_error(
                    goal, f"{message}; add it to frame_paths, or remove the column from the file"
                )
            return table
        if self.states is None or not self.states.filepath.strip():
            raise problem.invalid_error(goal, "a reference file is required")
        motion = read_reference(problem, goal, self.states)
        labels = tuple(f"{path}{end}" for path in paths for end in endings)
        values = self._compute_values(problem, motion, paths)
        return StoTable("", motion.times, labels, values, file=motion.file)

    def _compute_values(self, problem: Problem, motion: StoTable, paths: Sequence[str]) -> Array:
        """Compute the reference values in a motion.

        Args:
            problem: problem with the functions of the model.
            motion: table of states; those that it leaves out have the model's default values.
            paths: paths of the frames.

        Returns:
            Values (times, frames * components).
        """
        functions = problem.functions
        for column in motion.columns:
            problem.check_name(self.goal, column, functions.states, "state")
        required_columns = [f"{path}/value" for path in functions.coordinates]
        if missing := [name for name in required_columns if name not in motion.columns]:
            raise problem.invalid_error(self.goal, f"states_reference has no column '{missing[0]}'")
        frames = functions.frames(paths)
        rows = []
        # Default values, for states that the motion leaves out.
        x = np.array(functions.x)
        indices = [functions.states.index(column) for column in motion.columns]
        for time, row in zip(motion.times, motion.rows, strict=True):
            x[indices] = row
            values = np.array(frames(t=time, x=x, p=functions.p)[self.part]).T
            if self.kind == "Quaternion":
                # The functions give rotation matrices column by column.
                values = quaternion_of(values.reshape(len(paths), 3, 3).transpose(0, 2, 1))
            rows.append(values.ravel())
        return np.array(rows)
