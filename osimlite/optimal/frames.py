"""Frames that follow what is given of them: what four goals share."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from osimlite.base.records import dataclass
from osimlite.derivatives.symbols import casadi
from osimlite.errors import DocumentError
from osimlite.io.tables.headers import suffixes
from osimlite.io.tables.storage import StoTable, read_sto
from osimlite.mechanics.multibody.spatial import Array, quaternion
from osimlite.optimal.point import Formula, Frame, GoalTerms, Point, make_integral_terms
from osimlite.optimal.problem import Problem
from osimlite.optimal.tables import fit_splines, read_reference
from osimlite.schema.base import Component
from osimlite.schema.moco.goals import MocoGoal
from osimlite.schema.moco.parts import MocoWeightSet
from osimlite.schema.tools.processors import TableProcessor


@dataclass(frozen=True, eq=False)
class FrameReference:
    """What of frames follows what.

    Attributes: goal: that asks for it. file: with a column for each frame; none if empty. states: a
        motion of the model, from which the same is computed if there is no file; None if there
        cannot be one. paths: of the frames. weights: by these. kind: of the values in the file, as
        its header names it. part: of the result of ``functions.frames`` that is followed.
    """

    goal: MocoGoal
    file: str
    states: TableProcessor | None
    paths: Sequence[str | Component]
    weights: MocoWeightSet
    kind: str
    part: str = ""

    def terms(
        self, problem: Problem, error: Callable[[Point, Frame, Formula], Formula]
    ) -> GoalTerms:
        """The integral of the weighted sum of what is missing of each frame.

        Args:
            problem: with the frames.
            error: at a point, of a frame and of what is given there (k, 1), what counts.

        Raises:
            DocumentError: there are no such frames, or nothing is given for them.
        """
        paths, goal = [str(path) for path in self.paths], self.goal
        for path in paths:
            problem.check_name(goal, path, problem.functions.mechanism.frames, "frame")
        if not paths:
            raise problem.invalid_error(
                goal, "frame_paths names no frames, which OpenSim refuses, too"
            )
        table = self._table(problem, paths)
        size = len(suffixes(self.kind))
        series = fit_splines(
            problem, table, [f"{path}{end}" for path in paths for end in suffixes(self.kind)]
        )
        known = {weight.name: weight.weight for weight in self.weights.objects}

        def integrand(point: Point) -> Formula:
            total = casadi.SX(0.0)
            for number, path in enumerate(paths):
                given = [
                    point.evaluate(own) for own in series[size * number : size * number + size]
                ]
                total += known.get(path, 1.0) * error(
                    point, point.frame(path), casadi.vertcat(*given)
                )
            return total

        return make_integral_terms(integrand)

    def _table(self, problem: Problem, paths: Sequence[str]) -> StoTable:
        goal, ends = self.goal, suffixes(self.kind)
        if self.file.strip():
            if self.states is not None and self.states.filepath.strip():
                raise problem.invalid_error(
                    goal, "it names a file and a states_reference; one is enough"
                )
            table = read_sto(problem.locate_file(self.file))
            if table.kind != self.kind:
                message = f"the table holds {table.kind}, not {self.kind}; its header must say DataType={self.kind}"
                raise DocumentError(message, file=table.file)
            there = [column.removesuffix(ends[0]) for column in table.columns[:: len(ends)]]
            if other := [path for path in there if path not in paths]:
                # OpenSim 4.6 takes all columns of the file, whatever frame_paths says.
                message = f"frame_paths leaves out '{other[0]}' of {self.file}, which OpenSim follows all the same"
                raise problem.invalid_error(
                    goal, f"{message}; name it, or take the column out of the file"
                )
            return table
        if self.states is None or not self.states.filepath.strip():
            raise problem.invalid_error(goal, "it names no file to follow")
        motion = read_reference(problem, goal, self.states)
        columns = tuple(f"{path}{end}" for path in paths for end in ends)
        return StoTable(
            "", motion.times, columns, self._computed(problem, motion, paths), file=motion.file
        )

    def _computed(self, problem: Problem, motion: StoTable, paths: Sequence[str]) -> Array:
        """What is followed (n, values) in a motion; states that it leaves out are those of the model."""
        functions = problem.functions
        for column in motion.columns:
            problem.check_name(self.goal, column, functions.states, "state")
        if missing := [
            f"{path}/value"
            for path in functions.coordinates
            if f"{path}/value" not in motion.columns
        ]:
            raise problem.invalid_error(
                self.goal, f"its states_reference has no column '{missing[0]}'"
            )
        frames, rows = functions.frames(paths), []
        x = np.array(functions.x)
        places = [functions.states.index(column) for column in motion.columns]
        for time, row in zip(motion.times, motion.rows, strict=True):
            x[places] = row
            found = np.array(frames(t=time, x=x, p=functions.p)[self.part]).T
            if self.kind == "Quaternion":
                found = quaternion(found.reshape(len(paths), 3, 3).transpose(0, 2, 1))
            rows.append(found.ravel())
        return np.array(rows)
