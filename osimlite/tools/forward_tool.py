"""OpenSim's ForwardTool: integration of the motion of a model from an initial state."""

from __future__ import annotations

import numpy as np

from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.tools.dynamics import ForwardTool
from osimlite.simulation.engines.protocol import EngineSettings
from osimlite.simulation.options import MAX_FIXED_STEPS
from osimlite.simulation.run import Simulation
from osimlite.tools.dynamics_setup import (
    StateRows,
    build_model,
    build_simulation,
    compute_analyses,
    find_analyses,
    report_rows,
)
from osimlite.tools.job import Job
from osimlite.tools.motion import Motion
from osimlite.tools.outcome import Outcome


def run_forward_tool(job: Job, outcome: Outcome) -> None:
    """Integrate with OpenSim's steps; write states, controls and analyses at the end of each.

    Args:
        job: setup, a ForwardTool.
        outcome: outcome to which the results are added.
    """
    setup: ForwardTool = job.setup
    analyses = find_analyses(job)
    bounds = setup.minimum_integrator_step_size, setup.maximum_integrator_step_size
    if not 0.0 < setup.integrator_error_tolerance < 1.0:
        raise job.create_error(
            "OpenSim does not finish with integrator_error_tolerance "
            f"{setup.integrator_error_tolerance:g}; "
            "set a value between 0 and 1, such as 1e-5"
        )
    if not 0.0 <= bounds[0] <= bounds[1] or bounds[1] == 0.0:
        raise job.create_error(
            f"step sizes from {bounds[0]:g} s to {bounds[1]:g} s are invalid; set a larger "
            "maximum_integrator_step_size"
        )
    model = build_model(job)
    with build_simulation(job, model) as simulation:
        start, y = _compute_start(job, outcome, simulation)
        if not start < setup.final_time:
            raise job.create_error(
                f"the final_time, {setup.final_time:g} s, is not after the start, {start:g} s; "
                "set a later final_time"
            )
        # Every step is recorded, so that their number bounds the memory.
        if setup.final_time - start > MAX_FIXED_STEPS * bounds[1]:
            raise job.create_error(
                f"too many steps of {bounds[1]:g} s are needed until the final_time, {setup.final_time:g} s; "
                "set an earlier final_time or a larger maximum_integrator_step_size"
            )
        settings = EngineSettings(accuracy=setup.integrator_error_tolerance, step_bounds=bounds)
        times, states, failure = simulation.record_every_step(start, y, setup.final_time, settings)
        outcome.done = failure is None
        if failure is not None:
            outcome.add_message("ended early", failure.message)
        steps = list(zip(times, states, strict=True))
        motion = Motion(model, simulation, np.array(times), np.array(states), steps)
        _write_tables(job, outcome, motion)
        compute_analyses(job, outcome, analyses, motion)
    report_rows(job, outcome, motion)


def _compute_start(job: Job, outcome: Outcome, simulation: Simulation) -> tuple[float, list[float]]:
    """Return the initial time and state: the last row of the states file up to the initial time.

    Args:
        job: setup of the tool, with the paths of its files.
        outcome: outcome to which messages are added.
        simulation: simulation of the model.

    Returns:
        Time in s, and state (y,).
    """
    setup: ForwardTool = job.setup
    start = setup.initial_time
    path = job.find_path("states_file")
    if path is None:
        y = simulation.initial_state({}, {})
    else:
        state_rows = StateRows.read(job, path, simulation)
        state_rows.report_missing(outcome)
        row = state_rows.find_row(start)
        # OpenSim starts at the time of the row, not at the initial time of the setup.
        start = float(state_rows.table.times[row])
        y = state_rows.create_state(simulation, row)
        if start != setup.initial_time:
            outcome.add_message(
                "start",
                f"{start:g} s, the time of the last row in the states_file that is not after initial_time",
            )
    if setup.solve_for_equilibrium_for_auxiliary_states:
        y = simulation.engine.equilibrate_muscles(start, y)
    return start, y


def _write_tables(job: Job, outcome: Outcome, motion: Motion) -> None:
    """Add the tables of states and controls."""
    setup: ForwardTool = job.setup
    simulation = motion.simulation
    times = motion.times
    precision = setup.output_precision
    rotational_paths = [
        info.path for info in motion.mechanism.coordinates if info.motion_type == "rotational"
    ]
    # The file in degrees has rotational coordinates and their speeds in degrees; translations
    # remain.
    factors = [
        np.degrees(1.0) if path.rpartition("/")[0] in rotational_paths else 1.0
        for path in simulation.paths
    ]
    rows: Array = np.column_stack([*motion.histories.values()])
    name = setup.name

    def write_table(ending: str, table: StoTable, description: str = "") -> None:
        outcome.add_table(job.get_results_path(f"{name}_{ending}"), table, description, precision)

    paths = tuple(simulation.paths)
    write_table("states.sto", StoTable(name, times, paths, rows))
    simm = f"""
# SIMM Motion File Header:
name {name}
datacolumns {len(paths) + 1}
datarows {len(times)}
otherdata 1
range {times[0]:f} {times[-1]:f}"""
    write_table(
        "states_degrees.mot", StoTable(name, times, paths, rows * factors, in_degrees=True), simm
    )
    labels = tuple(path.rpartition("/")[2] for path in simulation.forces.controls.names)
    # For a model without actuators OpenSim writes a table without rows.
    controls = (
        motion.evaluate_kernels(motion.system.control_offsets) if labels else np.empty((0, 0))
    )
    write_table("controls.sto", StoTable("controls", times[: len(controls)], labels, controls))
