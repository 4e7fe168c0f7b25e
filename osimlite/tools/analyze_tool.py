"""OpenSim's AnalyzeTool: analyses along a motion that is already known."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from osimlite.base.text import join_words
from osimlite.io.tables.storage import read_sto
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.schema.tools.dynamics import AnalyzeTool
from osimlite.simulation.initial_state import columns_of_states
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
from osimlite.tools.motion import BoolArray, Motion, Record
from osimlite.tools.outcome import Outcome

SAME_TIME = 2.0**-45.5
"""How much later or earlier a row of speeds may be than that of the coordinates, s."""
MOST_SPANS = 5
"""Spans of time without an equilibrium that a message names."""


def run_analyze_tool(job: Job, outcome: Outcome) -> None:
    """Compute every analysis that is on along the rows of the motion between two times."""
    setup: AnalyzeTool = job.setup
    analyses = find_analyses(job)
    if not analyses:
        raise job.error("none of its analyses is on; give it one")
    states = job.path("states_file")
    model = build_model(job)
    with build_simulation(job, model) as simulation:
        if states is None:
            first, rows, record = _followed(job, outcome, simulation, model)
        else:
            given = StateRows.read(job, states, simulation)
            given.tell(outcome)
            first, last = given.row(setup.initial_time), given.row(setup.final_time)
            table, record = given.table, lambda: (given.table.times, given.speeds(simulation))
            rows = (
                (float(table.times[k]), given.state(simulation, k)) for k in range(first, last + 1)
            )
        moments = list(rows)
        if not moments:
            raise job.error(
                f"there is nothing from {setup.initial_time:g} s to {setup.final_time:g} s"
            )
        times, result = np.array([t for t, _ in moments]), np.array([y for _, y in moments])
        unbalanced: dict[str, BoolArray] = {}
        if setup.solve_for_equilibrium_for_auxiliary_states:
            unbalanced = equilibrate_rows(outcome, simulation, times, result)
        motion = Motion(
            model,
            simulation,
            times,
            result,
            record=record,
            unbalanced=unbalanced,
            simulate=lambda changed: build_simulation(job, changed),
        )
        compute_analyses(job, outcome, analyses, motion, first)
    report_rows(job, outcome, motion)


def equilibrate_rows(
    outcome: Outcome, simulation: Simulation, times: Array, states: Array
) -> dict[str, BoolArray]:
    """Equilibrate the muscles at every time, and report which have no equilibrium and when.

    Like OpenSim's AnalyzeTool, this goes on where a muscle has no equilibrium. OpenSim leaves the
    fibers of that muscle in any state then, and computes forces and accelerations from it; here its
    states become NaN.

    Args:
        outcome: that says so.
        simulation: whose engine finds the equilibria.
        times: (t,), s.
        states: (t, y), changed in place.

    Returns:
        By path of each muscle that has no equilibrium at some time: whether it has none (t,).
    """
    engine = simulation.engine
    assert isinstance(engine, System)
    unbalanced: dict[str, BoolArray] = {}
    reasons: dict[str, str] = {}
    for row, (time, y) in enumerate(zip(times.tolist(), states.tolist(), strict=True)):
        states[row], failed = engine.equilibrate_each(time, y)
        for path, reason in failed.items():
            reasons.setdefault(path, reason)
            unbalanced.setdefault(path, np.zeros(len(times), dtype=bool))[row] = True
    elements = {element.path: element for element in simulation.forces.elements}
    for path, missing in unbalanced.items():
        element = elements[path]
        if element.states:
            place = simulation.state.first_of(element)
            states[missing, place : place + len(element.states)] = np.nan
        outcome.tell(
            "no equilibrium",
            f"of {reasons[path]}: at {np.count_nonzero(missing)} of {len(times)} moments, {_spans(times, missing)}; "
            "what depends on its fibers or its force is NaN then",
        )
    outcome.summary["without_equilibrium"] = {
        path: times[missing].tolist() for path, missing in unbalanced.items()
    }
    if not unbalanced:
        del outcome.summary["without_equilibrium"]
    return unbalanced


def _spans(times: Array, chosen: BoolArray) -> str:
    """Return the spans of consecutive times that are chosen, in words."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(int)))
    spans = [(times[first], times[last - 1]) for first, last in edges.reshape(-1, 2)]
    words = [f"at {a:g} s" if a == b else f"from {a:g} s to {b:g} s" for a, b in spans]
    return join_words(words, most=MOST_SPANS)


def _followed(
    job: Job, outcome: Outcome, simulation: Simulation, model: Model
) -> tuple[int, Iterator[tuple[float, list[float]]], Callable[[], Record]]:
    """The number of the first row, times and states from the coordinates of a setup, and the record of all speeds."""
    setup: AnalyzeTool = job.setup
    mechanism = simulation.mechanism
    recorded = RecordedMotion.read(mechanism, job.needed("coordinates_file"))
    infos = enumerate(mechanism.coordinates)
    if absent := {
        info.name: k for k, info in infos if info.name in recorded.missing and not info.locked
    }:
        # Not their default values: so OpenSim's analyses have it, unlike its inverse dynamics.
        recorded.values[:, [*absent.values()]] = 0.0
        outcome.tell("not in the file", f"{join_words([*absent])}: 0 is taken, as in OpenSim")
    cutoff = setup.lowpass_cutoff_frequency_for_coordinates
    if cutoff >= 0.0:
        recorded = recorded.lowpassed(cutoff, continued=True)
    before = recorded
    recorded = recorded.between(setup.initial_time, setup.final_time)
    # OpenSim takes the rates of coordinates for the speeds, as they are before the constraints
    # change the values.
    given = job.path("speeds_file")
    others: dict[int, Array] = {}
    if given is None:
        speeds = recorded.rates[0]
    else:
        own, speeds, others = _given(job, given, recorded, simulation)
    rows = zip(
        recorded.times.tolist(),
        *satisfy_constraints(recorded, speeds, simulation, model),
        strict=True,
    )

    def states() -> Iterator[tuple[float, list[float]]]:
        for number, (t, q, u) in enumerate(rows):
            y = simulation.state.pack(q.tolist(), u.tolist())
            for place, column in others.items():
                y[place] = float(column[number])
            yield t, y

    first = int(np.searchsorted(before.times, recorded.times[0]))
    return first, states(), lambda: (before.times, before.rates[0]) if given is None else own


def _given(
    job: Job, path: Path, recorded: RecordedMotion, simulation: Simulation
) -> tuple[Record, Array, dict[int, Array]]:
    """Times and speeds of a file, and at those of a motion its speeds (t, n) and its auxiliary states (t,) by place.

    Speeds without a column have their default values.

    Raises:
        DocumentError: the file has no speeds, or lacks a time.
    """
    table, infos = read_sto(path), recorded.mechanism.coordinates
    paths = [f"{info.path}/speed" for info in infos]
    columns = columns_of_states(table.columns, paths)
    if not columns:
        raise job.error(f"'{path}' has no column with a speed of the model")
    speeds = np.tile([float(info.default_speed) for info in infos], (len(table.times), 1))
    rows = np.searchsorted(table.times, recorded.times - SAME_TIME)
    for row, time in zip(rows.tolist(), recorded.times.tolist(), strict=True):
        if row == len(table.times) or abs(table.times[row] - time) > SAME_TIME:
            raise job.error(
                f"'{path}' has no row at {time:.15g} s, at which there are coordinates; give it one"
            )
    for name, place in columns.items():
        speeds[:, paths.index(name)] = table.rows[:, place]
    state = simulation.state
    first, auxiliary = 2 * len(state.order), columns_of_states(table.columns, state.paths)
    others = {
        first + state.paths.index(name): table.rows[rows, place]
        for name, place in auxiliary.items()
    }
    return (table.times, speeds), speeds[rows], others
