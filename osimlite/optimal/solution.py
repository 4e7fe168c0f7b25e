"""Solutions of Moco studies: solve a study, evaluate a trajectory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass
from osimlite.errors import OsimliteError
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source
from osimlite.io.tables.storage import StoTable
from osimlite.optimal.ipopt import Progress, Violation, find_violations
from osimlite.optimal.ipopt import run_ipopt as search
from osimlite.optimal.problem import Problem
from osimlite.optimal.program import Program
from osimlite.optimal.refinement import Refinement, Round, solve_with_refinement
from osimlite.optimal.study_context import name_file_in_errors
from osimlite.optimal.trajectory import MocoTrajectory
from osimlite.schema.moco.goals import MocoPeriodicityGoal
from osimlite.schema.moco.studies import MocoStudy


@dataclass(frozen=True, eq=False)
class MocoSolution:
    """Solution of a Moco study.

    Attributes:
        trajectory: motion with all variables.
        success: whether it is a solution within the study's tolerances.
        status: Ipopt's return status.
        objective: value of the objective.
        terms: weighted part of the objective of each goal, by the goal's name.
        violations: largest violations of the constraints, the largest first.
        iterations: number of iterations on all meshes.
        duration: duration of the search, s.
        rounds: search on each mesh with the largest error of its intervals; empty without
            refinement.
        stride: motion and its next period, if a MocoPeriodicityGoal says how it continues; else
            None.
    """

    trajectory: MocoTrajectory
    success: bool
    status: str
    objective: float
    terms: dict[str, float]
    violations: list[Violation]
    iterations: int
    duration: float
    rounds: tuple[Round, ...] = ()
    stride: MocoTrajectory | None = None

    @property
    def states(self) -> StoTable:
        """Return the table of the states over time; m, rad, m/s, rad/s, and 1 for muscles."""
        return self.trajectory.table("states")

    @property
    def controls(self) -> StoTable:
        """Return the table of the controls over time."""
        return self.trajectory.table("controls")

    @property
    def parameters(self) -> dict[str, float]:
        """Return the values of the parameters.

        Returns:
            Value of each parameter by its name.
        """
        return self.trajectory.parameters

    def write(self, path: str | Path) -> None:
        """Write a solution file as Moco's, which OpenSim's MocoTrajectory reads.

        Args:
            path: path of the file, whose folder is made if it does not exist.

        Raises:
            OsimliteError: the file cannot be written.
        """
        self.trajectory.write(path)


def solve(
    study: str | Path | MocoStudy,
    *,
    guess: str | Path | MocoTrajectory | None = None,
    folder: str | Path | None = None,
    tell: Callable[[Progress], None] | None = None,
    refine: float | str | Refinement | None = None,
    scaled: Mapping[str, str] | None = None,
) -> MocoSolution:
    """Solve a Moco study: the same nonlinear program as Moco's, with exact derivatives.

    Args:
        study: study file or study.
        guess: initial trajectory or its file, instead of the study's guess; without either the
            search starts in the middle between the bounds of each variable.
        folder: folder of the files that a study without a file names; the current folder if None.
        tell: function that is called with the progress after each iteration. Ctrl-C stops the
            search, and the solution is then the best iterate.
        refine: largest error of an interval of the mesh: intervals above it are split, see
            :class:`Refinement`; None to keep the mesh.
        scaled: column of the goal's table that each scale factor of a goal multiplies, by the
            factor's name: what OpenSim's ``addScaleFactor`` receives, and no file contains.

    Returns:
        The solution; `success` says whether it meets the tolerances, `violations` what it violates.

    Raises:
        UnsupportedError: the study contains something that is not supported here; the message says
            what and where.
        OsimliteError: the study cannot be read, or is invalid.
    """
    with name_file_in_errors(study):
        return solve_program(Program(build_problem(study, folder, scaled)), guess, tell, refine)


def build_problem(
    study: str | Path | MocoStudy,
    folder: str | Path | None = None,
    scaled: Mapping[str, str] | None = None,
) -> Problem:
    """Build the optimal control problem of a study.

    Args:
        study: study file or study.
        folder: folder of the files that a study without a file names; the current folder if None.
        scaled: column of a table for each scale factor of a goal, see :func:`solve`.

    Returns:
        Problem, which :func:`evaluate` can evaluate for several trajectories.

    Raises:
        OsimliteError: as for :func:`solve`.
    """
    if isinstance(study, MocoStudy):
        return Problem(study, folder=None if folder is None else Path(folder), scaled=scaled)
    with name_file_in_errors(study):
        study_object: Any = read_document(
            Source.from_file(Path(study)), expected_class=MocoStudy
        ).top
        return Problem(study_object, Path(study), scaled=scaled)


def solve_program(
    program: Program,
    guess: str | Path | MocoTrajectory | None,
    tell: Callable[[Progress], None] | None,
    refine: float | str | Refinement | None = None,
) -> MocoSolution:
    """Solve a nonlinear program.

    Args:
        program: nonlinear program.
        guess: initial guess, see :func:`solve`.
        tell: function that is called with the progress after each iteration; None for none.
        refine: accuracy or settings of mesh refinement, see :func:`solve`.

    Returns:
        Solution on the last mesh, with its violations and, if the goals say how it continues, its
        stride.
    """
    problem = program.problem
    rounds = list[Round]()
    # A guess of the caller overrides that of the study.
    if guess is None and problem.solver.guess_file.strip():
        guess = problem.locate_file(problem.solver.guess_file)
    if isinstance(guess, str | Path):
        guess = MocoTrajectory.read(guess)
    start = (
        program.layout.make_guess()
        if guess is None
        else program.layout.guess_from_trajectory(guess)
    )
    if refine is None:
        result = search(program, start, tell)
    else:
        program, result, rounds = solve_with_refinement(
            program, start, Refinement.parse(refine), tell
        )
    # Rounds are empty without refinement.
    iterations = sum(mesh_round.iterations for mesh_round in rounds) or result.iterations
    duration = sum(mesh_round.duration for mesh_round in rounds) or result.duration
    costs, rows = program.compute_values(result.w)
    terms = dict(zip(program.costs, costs.tolist(), strict=True))
    header = {
        "num_iterations": str(iterations),
        # Entries and digits of the header are those of Moco's solution files.
        "objective": f"{costs.sum():.6f}",
        **{f"objective_{name}": f"{cost:.6f}" for name, cost in terms.items()},
        "solver_duration": f"{duration:.6f}",
        "status": result.status,
        "success": "true" if result.success else "false",
    }
    trajectory = MocoTrajectory.from_variables(program.layout, result.w, header)
    return MocoSolution(
        trajectory=trajectory,
        success=result.success,
        status=result.status,
        objective=float(costs.sum()),
        terms=terms,
        violations=find_violations(program, result.w, rows),
        iterations=iterations,
        duration=duration,
        rounds=tuple(rounds),
        stride=append_next_period(problem, trajectory),
    )


class Evaluation(NamedTuple):
    """Objective and violations of a trajectory that was not searched for."""

    terms: dict[str, float]
    """Weighted part of the objective of each goal, by the goal's name."""
    violations: list[Violation]
    """Largest violations of the constraints, the largest first."""

    @property
    def objective(self) -> float:
        """Sum of the parts of the objective."""
        return sum(self.terms.values())


def evaluate(
    study: str | Path | MocoStudy | Problem | Program,
    trajectory: str | Path | MocoTrajectory,
    *,
    folder: str | Path | None = None,
    scaled: Mapping[str, str] | None = None,
) -> Evaluation:
    """Evaluate the objective and the constraints of a study for a trajectory, without a search.

    Args:
        study: study file or study; also a problem of :func:`build_problem` or its nonlinear program.
        trajectory: trajectory, or a file that Moco or :func:`solve` wrote. Its columns are
            interpolated by splines where its times differ from those of the study's grid.
        folder: folder of the files that a study without a file names; the current folder if None.
        scaled: column of a table for each scale factor of a goal, see :func:`solve`.

    Returns:
        Parts of the objective by goal, and the largest violations.

    Raises:
        UnsupportedError: the study contains something that is not supported here.
        OsimliteError: a file cannot be read, or the trajectory lacks the column of a variable.
    """
    if isinstance(study, Program):
        program = study
    elif isinstance(study, Problem):
        program = Program(study)
    else:
        with name_file_in_errors(study):
            program = Program(build_problem(study, folder, scaled))
    if not isinstance(trajectory, MocoTrajectory):
        trajectory = MocoTrajectory.read(trajectory)
    layout = program.layout
    for name in (*layout.names["states"], *layout.names["controls"], *layout.names["multipliers"]):
        if name not in trajectory.columns:
            raise OsimliteError(f"the trajectory has no column '{name}'")
    w = layout.guess_from_trajectory(trajectory)
    costs, rows = program.compute_values(w)
    terms = dict(zip(program.costs, costs.tolist(), strict=True))
    return Evaluation(terms, find_violations(program, w, rows))


def append_next_period(problem: Problem, trajectory: MocoTrajectory) -> MocoTrajectory | None:
    """Return the motion and its next period, if a MocoPeriodicityGoal says how the motion continues.

    A goal of half a stride thus gives the complete stride. A variable whose final value equals
    another's initial value (or its negative) continues as that one did. Variables without a pair,
    such as the distance travelled, change once more as in this period. Multipliers, slacks and
    derivatives are left out.

    Args:
        problem: problem with the goals.
        trajectory: motion of one period.

    Returns:
        Motion of two periods; None without a pair in any MocoPeriodicityGoal.
    """
    goals = [goal for goal, _ in problem.goals if isinstance(goal, MocoPeriodicityGoal)]
    pairs = [pair for goal in goals for pair in (*goal.state_pairs, *goal.control_pairs)]
    if not pairs:
        return None
    start, end = trajectory.times[[0, -1]]
    follows = {pair.final_variable: pair for pair in pairs}
    names = {kind: trajectory.names[kind] for kind in ("states", "controls")}
    columns = {}
    for name in (*names["states"], *names["controls"]):
        column = trajectory.columns[name]
        pair = follows.get(name)
        if pair is None:
            # Continued by its increase, such as the distance travelled.
            continuation = column + (column[-1] - column[0])
        else:
            continuation = (-1.0 if pair.negate else 1.0) * trajectory.columns[
                pair.initial_variable
            ]
        # The end of the first period is the start of the second, and has one row.
        columns[name] = np.concatenate([column, continuation[1:]])
    times = np.concatenate([trajectory.times, trajectory.times[1:] + (end - start)])
    return MocoTrajectory(times, columns, names, trajectory.parameters)
