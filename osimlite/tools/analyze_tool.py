"""OpenSim's AnalyzeTool: analyses along a motion that a file prescribes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from osimlite.base.progress import watch_items
from osimlite.base.text import format_count, join_words
from osimlite.io.tables.storage import read_sto
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.schema.tools.dynamics import AnalyzeTool
from osimlite.simulation.initial_state import match_state_columns
from osimlite.simulation.recorded_motion import RecordedMotion
from osimlite.simulation.run import Simulation
from osimlite.simulation.system import System
from osimlite.tools.dynamics_setup import (
    StateRows,
    build_model,
    build_simulation,
    compute_analyses,
    find_analyses,
    report_rows,
    satisfy_constraints,
)
from osimlite.tools.job import Job
from osimlite.tools.motion import BoolArray, Motion, SpeedRecord
from osimlite.tools.outcome import Outcome

TIME_TOLERANCE_S = 2.0**-45.5
"""Largest difference of the times of rows of speeds and of coordinates that count as equal, s."""
MAX_NAMED_SPANS = 5
"""Number of time spans without equilibrium that a message names."""


def run_analyze_tool(job: Job, outcome: Outcome) -> None:
    """Compute every analysis that is on along the rows of a motion between two times.

    Args:
        job: setup, an AnalyzeTool.
        outcome: outcome to which the results are added.
    """
    setup: AnalyzeTool = job.setup
    analyses = find_analyses(job)
    if not analyses:
        raise job.create_error("no analysis of the setup is on; add one, or set <on>true</on>")
    # OpenSim's comparisons with NaN are false, so that the motion does not end before its data.
    if math.isnan(setup.final_time):
        setup.final_time = math.inf
    states = job.find_path("states_file")
    model = build_model(job)
    with build_simulation(job, model) as simulation:
        # Either states or coordinates define the motion; states have precedence.
        if states is None:
            first_row, rows, record = _read_coordinate_motion(job, outcome, simulation, model)
        else:
            state_rows = StateRows.read(job, states, simulation)
            state_rows.report_missing(outcome)
            first_row = state_rows.find_row(setup.initial_time)
            last_row = state_rows.find_row(setup.final_time)
            table = state_rows.table
            rows = (
                (float(table.times[k]), state_rows.create_state(simulation, k))
                for k in range(first_row, last_row + 1)
            )

            def record() -> tuple[Array, Array]:
                return table.times, state_rows.read_speeds(simulation)

        moments = list(rows)
        if not moments:
            raise job.create_error(
                f"the motion has no row from {setup.initial_time:g} s to {setup.final_time:g} s; "
                "change initial_time or final_time"
            )
        times, result = np.array([t for t, _ in moments]), np.array([y for _, y in moments])
        unbalanced: dict[str, BoolArray] = {}
        if setup.solve_for_equilibrium_for_auxiliary_states:
            affects_results = {type(analysis).__name__ for analysis, _ in analyses} != {
                "StaticOptimization"
            }
            unbalanced = equilibrate_rows(
                outcome, simulation, times, result, affects_results=affects_results
            )
        motion = Motion(
            model,
            simulation,
            times,
            result,
            record=record,
            unbalanced=unbalanced,
            simulate=lambda changed_model: build_simulation(job, changed_model),
        )
        compute_analyses(job, outcome, analyses, motion, first_row)
    report_rows(job, outcome, motion)


def equilibrate_rows(
    outcome: Outcome,
    simulation: Simulation,
    times: Array,
    states: Array,
    *,
    affects_results: bool,
) -> dict[str, BoolArray]:
    """Equilibrate the muscles at every time, and report muscles without equilibrium.

    Like OpenSim's AnalyzeTool, this continues where a muscle has no equilibrium. OpenSim then
    leaves the fibers of that muscle in an arbitrary state, and computes forces and accelerations
    from it. Here the states of the muscle become NaN.

    Args:
        outcome: outcome to which messages are added.
        simulation: simulation of the model, whose engine computes the equilibria.
        times: times (t,), s.
        states: states (t, y), changed in place.
        affects_results: whether an analysis uses states of muscles; StaticOptimization does not.

    Returns:
        Masks (t,) of the times without equilibrium, by path of the muscle; only muscles that lack one
        at some time are included.
    """
    engine = simulation.engine
    assert isinstance(engine, System)
    unbalanced: dict[str, BoolArray] = {}
    reasons: dict[str, str] = {}
    moments = [*zip(times.tolist(), states.tolist(), strict=True)]
    for row, (time, y) in enumerate(watch_items("equilibrating the muscles", moments)):
        states[row], failed = engine.equilibrate_each(time, y)
        for path, reason in failed.items():
            reasons.setdefault(path, reason)
            unbalanced.setdefault(path, np.zeros(len(times), dtype=bool))[row] = True
    elements = {element.path: element for element in simulation.forces.elements}
    consequence = (
        "Values that depend on the fibers or the force of this muscle are NaN at these times"
        if affects_results
        else "StaticOptimization does not use the equilibrium, so its results are not affected"
    )
    for path, missing in unbalanced.items():
        element = elements[path]
        # Muscles without states of their own have nothing to mark; their records become NaN below.
        if element.states:
            index = simulation.state.find_first_state(element)
            states[missing, index : index + len(element.states)] = np.nan
        outcome.add_message(
            "no equilibrium",
            f"{reasons[path]}. This concerns {np.count_nonzero(missing)} of {format_count(len(times), 'time')}, "
            f"{_describe_spans(times, missing)}. {consequence}",
        )
    outcome.summary["without_equilibrium"] = {
        path: times[missing].tolist() for path, missing in unbalanced.items()
    }
    if not unbalanced:
        del outcome.summary["without_equilibrium"]
    return unbalanced


def _describe_spans(times: Array, selected: BoolArray) -> str:
    """Return the spans of consecutive selected times, in words."""
    # Padding with False makes every span begin and end with a change.
    edges = np.flatnonzero(np.diff(np.concatenate([[False], selected, [False]]).astype(int)))
    spans = [(times[first], times[last - 1]) for first, last in edges.reshape(-1, 2)]
    descriptions = [f"at {a:g} s" if a == b else f"from {a:g} s to {b:g} s" for a, b in spans]
    return join_words(descriptions, max_count=MAX_NAMED_SPANS)


def _read_coordinate_motion(
    job: Job, outcome: Outcome, simulation: Simulation, model: Model
) -> tuple[int, Iterator[tuple[float, list[float]]], Callable[[], SpeedRecord]]:
    """Read the coordinates of a setup, filter them, and satisfy the constraints.

    Args:
        job: setup of the tool, with the paths of its files.
        outcome: outcome to which messages are added.
        simulation: simulation of the model.
        model: model of the simulation.

    Returns:
        Number of the first row; times with states; and a function that returns the times and speeds
        of the whole file.
    """
    setup: AnalyzeTool = job.setup
    mechanism = simulation.mechanism
    recorded = RecordedMotion.read(mechanism, job.require_path("coordinates_file"))
    infos = enumerate(mechanism.coordinates)
    if missing_indices := {
        info.name: k for k, info in infos if info.name in recorded.missing and not info.locked
    }:
        # OpenSim's analyses use 0 here, and its inverse dynamics the default values.
        recorded.values[:, [*missing_indices.values()]] = 0.0
        outcome.add_message(
            "not in the file", f"{join_words([*missing_indices])}: 0 is used, as in OpenSim"
        )
    cutoff = setup.lowpass_cutoff_frequency_for_coordinates
    if cutoff >= 0.0:
        recorded = recorded.apply_lowpass(cutoff, continued=True)
    complete_motion = recorded
    recorded = recorded.select_times(setup.initial_time, setup.final_time)
    # OpenSim uses the rates of the coordinates as speeds, before the constraints change the
    # values.
    speeds_path = job.find_path("speeds_file")
    auxiliary_columns: dict[int, Array] = {}
    if speeds_path is None:
        speeds = recorded.rates[0]
    else:
        record, speeds, auxiliary_columns = _read_speeds(job, speeds_path, recorded, simulation)
    rows = zip(
        recorded.times.tolist(),
        *satisfy_constraints(recorded, speeds, simulation, model),
        strict=True,
    )

    def yield_states() -> Iterator[tuple[float, list[float]]]:
        for number, (t, q, u) in enumerate(rows):
            y = simulation.state.pack(q.tolist(), u.tolist())
            for index, column in auxiliary_columns.items():
                y[index] = float(column[number])
            yield t, y

    first_row = int(np.searchsorted(complete_motion.times, recorded.times[0]))
    return (
        first_row,
        yield_states(),
        lambda: (
            (complete_motion.times, complete_motion.rates[0]) if speeds_path is None else record
        ),
    )


def _read_speeds(
    job: Job, path: Path, recorded: RecordedMotion, simulation: Simulation
) -> tuple[SpeedRecord, Array, dict[int, Array]]:
    """Read speeds and auxiliary states from the file of speeds, at the times of a motion.

    Speeds without a column have their default values.

    Args:
        job: setup of the tool, with the paths of its files.
        path: file of the speeds.
        recorded: motion of the coordinates.
        simulation: simulation of the model.

    Returns:
        Times and speeds of the file; speeds (t, n) at the times of the motion; auxiliary states
        (t,) by index in the state.

    Raises:
        DocumentError: the file has no speeds, or lacks a time of the motion.
    """
    table = read_sto(path)
    infos = recorded.mechanism.coordinates
    paths = [f"{info.path}/speed" for info in infos]
    columns = match_state_columns(table.columns, paths)
    if not columns:
        raise job.create_error(f"'{path}' has no column with a speed of the model")
    speeds = np.tile([float(info.default_speed) for info in infos], (len(table.times), 1))
    rows = np.searchsorted(table.times, recorded.times - TIME_TOLERANCE_S)
    for row, time in zip(rows.tolist(), recorded.times.tolist(), strict=True):
        if row == len(table.times) or abs(table.times[row] - time) > TIME_TOLERANCE_S:
            raise job.create_error(
                f"'{path}' has no row at {time:.15g} s, unlike the coordinates; add one"
            )
    for name, index in columns.items():
        speeds[:, paths.index(name)] = table.rows[:, index]
    state = simulation.state
    first_auxiliary = 2 * len(state.order)
    auxiliary_indices = match_state_columns(table.columns, state.paths)
    auxiliary_columns = {
        first_auxiliary + state.paths.index(name): table.rows[rows, index]
        for name, index in auxiliary_indices.items()
    }
    return (table.times, speeds), speeds[rows], auxiliary_columns
