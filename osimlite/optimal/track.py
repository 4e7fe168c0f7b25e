"""MocoTrack: a motion that tracks measured states or markers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from osimlite.base.records import replace
from osimlite.fitting.modifying.operators import process_model
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody.smoothing_spline import derivatives_of_samples
from osimlite.optimal.ipopt import Progress
from osimlite.optimal.problem import Problem
from osimlite.optimal.program import Program
from osimlite.optimal.refinement import Refinement
from osimlite.optimal.solution import MocoSolution, solve_program
from osimlite.optimal.tables import process_table
from osimlite.optimal.tool_study import make_study, set_time_range
from osimlite.optimal.trajectory import MocoTrajectory
from osimlite.schema.moco.goals import MocoControlGoal
from osimlite.schema.moco.parts import MocoWeight, MocoWeightSet
from osimlite.schema.moco.studies import MocoCasADiSolver, MocoStudy, MocoTrack
from osimlite.schema.moco.tracking import MocoMarkerTrackingGoal, MocoStateTrackingGoal
from osimlite.schema.tools.inverse_kinematics import MarkersReference, MarkerWeight, MarkerWeightSet

SPLINE_HALF_ORDER = 3
"""Half order of the splines whose derivatives are tracked: degree 5, as OpenSim's GCVSpline."""


def build_track_problem(
    tool: MocoTrack,
    file: Path | None = None,
    folder: Path | None = None,
    more: Callable[[MocoStudy], None] | None = None,
    scaled: Mapping[str, str] | None = None,
) -> tuple[Problem, MocoTrajectory | None]:
    """Build the optimal control problem of a MocoTrack.

    Args:
        tool: settings.
        file: setup file of the settings; None for settings that were not read from a file.
        folder: folder of the files that the settings name, for settings without a file; the current
            folder if None.
        more: function that changes the study before the problem is built: goals, bounds, solver;
            None for no change.
        scaled: column of a table for each scale factor of a goal, see :func:`osimlite.moco.solve`.

    Returns:
        The problem, and the guess; None for the middle between the bounds.

    Raises:
        UnsupportedError: the settings contain something that is not supported here.
        OsimliteError: the settings or their files are invalid.
    """
    base_folder = file.parent if file is not None else folder or Path(".")
    solver = MocoCasADiSolver(
        name="solver",
        # These settings are MocoTrack's own.
        optim_convergence_tolerance=1e-2,
        optim_constraint_tolerance=1e-2,
        optim_finite_difference_scheme="forward",
    )
    study = make_study(tool, process_model(tool.model, base_folder), solver)
    phase = study.problem.phases
    # A problem without goals gives the names of states, and errors with their line.
    problem_without_goals = Problem(study, file, base_folder)
    tables: dict[str, StoTable] = {}
    states = problem_without_goals.functions.states
    mechanism = problem_without_goals.functions.mechanism
    if tool.states_reference.filepath.strip():
        table = process_table(
            problem_without_goals, tool.states_reference, tool.states_reference, states, mechanism
        )
        if tool.track_reference_position_derivatives:
            # Speeds are tracked too, at derivatives of the splines through the values.
            table = _append_speeds(table)
        tables["state_tracking"] = table
        phase.goals.append(
            MocoStateTrackingGoal(
                name="state_tracking",
                weight=tool.states_global_tracking_weight,
                allow_unused_references=tool.allow_unused_references,
                scale_weights_with_range=tool.scale_state_weights_with_range,
                state_weights=MocoWeightSet(
                    name="state_weights",
                    objects=_find_state_weights(problem_without_goals, tool, table),
                ),
            )
        )
    if tool.markers_reference.filepath.strip():
        tables["marker_tracking"] = process_table(
            problem_without_goals, tool.markers_reference, tool.markers_reference, (), mechanism
        )
        phase.goals.append(_make_marker_goal(tool))
    if not tables:
        raise problem_without_goals.invalid_error(
            tool, "a states_reference or a markers_reference is required"
        )
    if tool.minimize_control_effort:
        weights = [weight.copy_deep() for weight in tool.controls_weight_set.objects]
        phase.goals.append(
            MocoControlGoal(
                name="control_effort",
                weight=tool.control_effort_weight,
                control_weights=MocoWeightSet(name="control_weights", objects=weights),
            )
        )
    start, end = set_time_range(problem_without_goals, tool, [*tables.values()], study)
    if more is not None:
        more(study)
    guess = None
    if tool.guess_file.strip():
        guess = MocoTrajectory.read(problem_without_goals.locate_file(tool.guess_file))
    problem = Problem(study, file, base_folder, tables, scaled=scaled)
    if tool.apply_tracked_states_to_guess and "state_tracking" in tables:
        table = tables["state_tracking"]
        # Moco spreads the rows evenly from the first time to the last, whatever their own times.
        times = np.linspace(start, end, len(table.times))
        states = {name: table[name] for name in table.columns if name in problem.states}
        if guess is not None:
            raise problem_without_goals.make_unsupported_error(
                tool, "guess_file and apply_tracked_states_to_guess cannot be combined"
            )
        guess = MocoTrajectory(times, states, {"states": tuple(states)})
    return problem, guess


def solve_track(
    tool: MocoTrack,
    *,
    folder: str | Path | None = None,
    more: Callable[[MocoStudy], None] | None = None,
    tell: Callable[[Progress], None] | None = None,
    refine: float | str | Refinement | None = None,
    scaled: Mapping[str, str] | None = None,
) -> MocoSolution:
    """Find a motion that tracks measured states or markers, as OpenSim's MocoTrack.

    Args:
        tool: settings.
        folder: folder of the files that the settings name; the current folder if None.
        more: function that changes the study before it is solved: goals, bounds, solver; None for
            no change.
        tell: function that is called with the progress after each iteration; None for none.
        refine: accuracy or settings of mesh refinement, see :func:`osimlite.moco.solve`.
        scaled: column of a table for each scale factor of a goal, see :func:`osimlite.moco.solve`.

    Returns:
        Solution with the motion and the controls.

    Raises:
        OsimliteError: as for :func:`build_track_problem`.
    """
    problem, guess = build_track_problem(
        tool, None, None if folder is None else Path(folder), more, scaled
    )
    return solve_program(Program(problem), guess, tell, refine)


def _make_marker_goal(tool: MocoTrack) -> MocoMarkerTrackingGoal:
    """Return the goal that tracks markers; markers without a weight have weight 1."""
    weights = [
        # The tool has MocoWeights, and the goal MarkerWeights.
        MarkerWeight(name=marker_weight.name, weight=marker_weight.weight)
        for marker_weight in tool.markers_weight_set.objects
    ]
    reference = MarkersReference(
        name="markers_reference",
        marker_weights=MarkerWeightSet(name="marker_weights", objects=weights),
    )
    return MocoMarkerTrackingGoal(
        name="marker_tracking",
        weight=tool.markers_global_tracking_weight,
        allow_unused_references=tool.allow_unused_references,
        markers_reference=reference,
    )


def _append_speeds(table: StoTable) -> StoTable:
    """Return the table with derivatives of those coordinate values that have no speed column."""
    value_and_speed_names = [
        (name, f"{name.removesuffix('/value')}/speed")
        for name in table.columns
        if name.endswith("/value")
    ]
    missing = [
        (value, speed) for value, speed in value_and_speed_names if speed not in table.columns
    ]
    if not missing:
        return table
    values = np.column_stack([table[value] for value, _ in missing])
    (speeds,) = derivatives_of_samples(table.times, values, table.times, (1,), SPLINE_HALF_ORDER)
    columns = (*table.columns, *(speed for _, speed in missing))
    return replace(table, columns=columns, rows=np.hstack([table.rows, speeds]))


def _find_state_weights(problem: Problem, tool: MocoTrack, table: StoTable) -> list[MocoWeight]:
    """Find the weights of tracked states.

    Args:
        problem: problem with the names of the states.
        tool: settings with the weights.
        table: reference table.

    Returns:
        Weights of the tool, and weight 0 for states that the model's constraints determine.
    """
    weight_by_name = {weight.name: weight.weight for weight in tool.states_weight_set.objects}
    result = {}
    for path in problem.functions.coordinates:
        # A constraint determines its dependent coordinate, whose tracking would fight with that of
        # the others.
        is_dependent = any(
            str(getattr(constraint, "dependent_coordinate_name", "")) == path.rpartition("/")[2]
            for constraint in problem.model.constraint_set.objects
            if constraint.isEnforced
        )
        for name in (f"{path}/value", f"{path}/speed"):
            if name in table.columns and (name in weight_by_name or is_dependent):
                result[name] = weight_by_name.get(name, 0.0)
    return [MocoWeight(name=name, weight=weight) for name, weight in result.items()]
