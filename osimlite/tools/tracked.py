"""A run of RRATool or CMCTool: the motion that a model makes while it follows another, and the files of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from osimlite.io.document.printer import to_text
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.control_sets import ControlSet
from osimlite.schema.model import Model
from osimlite.schema.tools.analyses import Actuation, Kinematics
from osimlite.schema.tools.tracking import CMCTool, RRATool
from osimlite.simulation.engines.protocol import Settings
from osimlite.simulation.run import Simulation
from osimlite.tools.computed_control import ComputedControl, Control, Followed
from osimlite.tools.job import Job
from osimlite.tools.motion import Motion
from osimlite.tools.outcome import Outcome
from osimlite.tools.through_time import analyse, analyses_of, simulation_of, tell_rows
from osimlite.tools.tracking import Desired, Sharing, Tasks, require_no_controllers

RESIDUALS = "FX", "FY", "FZ", "MX", "MY", "MZ"
"""What OpenSim's tools take for residual forces and moments of the pelvis."""


def track(
    job: Job, outcome: Outcome, model: Model, desired: Desired, window: float, exact: bool
) -> Motion | None:
    """Have a model follow a motion, and write what OpenSim writes of it; None if it does not begin.

    Args:
        job: the setup.
        outcome: that has the files written.
        model: with the forces of the setup.
        desired: the motion.
        window: for which controls are computed, s.
        exact: whether the accelerations must be met exactly.
    """
    setup: RRATool | CMCTool = job.setup
    require_no_controllers(job, model)
    analyses = analyses_of(job)
    have = {type(item) for item, _ in analyses}
    for cls in (Actuation, Kinematics):
        if cls not in have:
            setup.analysis_set.objects.append(cls(name=cls.__name__))
    for item in setup.analysis_set.objects:
        if isinstance(item, Kinematics):
            item.in_degrees = True
    analyses = analyses_of(job)
    start, end = max(setup.initial_time, desired.start), min(setup.final_time, desired.end)
    if not start < end - window:
        raise job.error(
            f"there is no window of {window:g} s from {start:g} s to {end:g} s; give a later final_time"
        )
    with simulation_of(job, model) as simulation:
        tasks = Tasks.of(job, simulation.mechanism)
        sharing = Sharing(job, model, simulation.mechanism, tasks, exact)
        controls = _controls(job, sharing, model)
        tracker = ComputedControl(job, simulation, desired, tasks, sharing, controls, window)
        y, followed = _first_state(job, simulation, desired, start), Followed()
        if tracker.has_states:
            start, y = tracker.at_rest(start, y, followed)
        if not followed.failure:
            bounds = setup.minimum_integrator_step_size, setup.maximum_integrator_step_size
            settings = Settings(setup.integrator_error_tolerance, step_bounds=bounds)
            before = followed.errors
            followed = tracker.follow(start, y, end - window, settings)
            followed.errors = before | followed.errors
        if followed.failure:
            outcome.done = False
            outcome.tell("ended early", followed.failure)
        if len(followed.times) < 2:
            return None
        tracker.drive_through()
        moments = list(zip(followed.times, followed.states, strict=True))
        motion = Motion(
            model, simulation, np.array(followed.times), np.array(followed.states), moments
        )
        _write(job, outcome, tracker, motion, followed)
        analyse(job, outcome, analyses, motion)
        _tell(job, outcome, motion, followed)
    return motion


def _controls(job: Job, sharing: Sharing, model: Model) -> list[Control]:
    path = job.path("constraints_file")
    given = None if path is None else job.read(path, ControlSet)
    actuators = {item.name: item for item in model.force_set.objects}
    return [Control.of(actuators[name], given) for name in sharing.names]


def _first_state(job: Job, simulation: Simulation, desired: Desired, start: float) -> list[float]:
    """Return the state (y,) of the desired motion at a time; fibers are where they were in the default pose.

    Like OpenSim's, it need not fulfil the constraints: only the integration that begins with it
    projects it. The controls of the first window are computed before, for the desired speeds:
    without an error of speeds to make up for.
    """
    in_equilibrium = (
        isinstance(job.setup, RRATool) or job.setup.solve_for_equilibrium_for_auxiliary_states
    )
    default = simulation.initial_state({}, {}, equilibrate=in_equilibrium)
    (wanted,) = desired.at(start)
    q, u = wanted[0], wanted[2]
    return simulation.state.pack(q.tolist(), u.tolist(), default[2 * len(simulation.state.order) :])


def _write(
    job: Job, outcome: Outcome, tracker: ComputedControl, motion: Motion, followed: Followed
) -> None:
    name, precision = job.setup.name, job.setup.output_precision

    def add(ending: str, table: StoTable) -> None:
        outcome.table(job.in_results(f"{name}_{ending}.sto"), table, precision=precision)

    paths = tuple(motion.simulation.paths)
    add(
        "states", StoTable(name, motion.times, paths, np.column_stack([*motion.histories.values()]))
    )
    labels = tuple(path.rpartition("/")[2] for path in motion.simulation.forces.controls.names)
    add(
        "controls",
        StoTable("controls", motion.times, labels, motion.looked(motion.system.places_of_controls)),
    )
    columns = tuple(task.name for task in tracker.tasks.tasks)
    errors = StoTable(
        "PositionErrors",
        np.array([*followed.errors]),
        columns,
        np.array([*followed.errors.values()]),
    )
    add("pErr", errors)
    controls = ControlSet(
        name=motion.model.name, objects=[item.document() for item in tracker.controls]
    )
    outcome.text(job.in_results(f"{name}_controls.xml"), to_text(controls, numbers="opensim"))


def _tell(job: Job, outcome: Outcome, motion: Motion, followed: Followed) -> None:
    tell_rows(job, outcome, motion)
    errors = np.abs([*followed.errors.values()])
    infos = motion.mechanism.coordinates
    turning = [info.name for info in infos if info.motion_type == "rotational"]
    table = outcome.tables[f"{job.setup.name}_pErr.sto"]
    for what, unit, factor, chosen in (
        ("angle", "deg", np.degrees(1.0), [k for k, n in enumerate(table.columns) if n in turning]),
        ("translation", "m", 1.0, [k for k, n in enumerate(table.columns) if n not in turning]),
    ):
        if chosen:
            worst = int(np.argmax(errors[:, chosen].max(axis=0)))
            largest = factor * float(errors[:, chosen].max())
            outcome.summary[f"worst_{what}"] = largest
            outcome.tell(
                f"worst {what}", f"{largest:.3g} {unit} off, {table.columns[chosen[worst]]}"
            )


def average_residuals(times: Array, columns: tuple[str, ...], rows: Array) -> list[float]:
    """Averages over time of the columns that OpenSim takes for residuals, 0 where there is none."""
    if len(times) < 2:
        return [0.0] * len(RESIDUALS)
    areas = np.trapezoid(rows, times, axis=0) / (times[-1] - times[0])
    return [float(areas[columns.index(name)]) if name in columns else 0.0 for name in RESIDUALS]


def residual_words(averages: list[float]) -> str:
    """Averages in words."""
    return ", ".join(
        f"{name} {value:.4g}" for name, value in zip(RESIDUALS, averages, strict=True) if value
    )


def model_file(job: Job, name: str) -> Path:
    """Where a changed model goes."""
    return job.result(name or "adjusted_model.osim")
