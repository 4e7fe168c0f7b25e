"""OpenSim's RRATool and CMCTool: a model follows a measured motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from osimlite.base.text import suggest_name
from osimlite.io.document.printer import to_text
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.smoothing_spline import derivatives_of_samples
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.control_sets import ControlSet
from osimlite.schema.frames import Body
from osimlite.schema.model import Model
from osimlite.schema.tools.analyses import Actuation, Kinematics
from osimlite.schema.tools.tracking import CMCTool, RRATool
from osimlite.simulation.engines.protocol import EngineSettings
from osimlite.simulation.run import Simulation
from osimlite.tools.computed_control import ActuatorControl, ComputedControl, TrackedMotion
from osimlite.tools.dynamics_setup import (
    build_model,
    build_simulation,
    build_static_optimization,
    compute_analyses,
    find_analyses,
    report_rows,
)
from osimlite.tools.job import Job
from osimlite.tools.motion import Motion
from osimlite.tools.outcome import Outcome
from osimlite.tools.tracking import (
    DesiredMotion,
    ForceDistribution,
    TrackingTasks,
    refuse_controllers,
)

RRA_WINDOW_S = 1e-3
"""Length of the windows of RRATool, s.

It is fixed in OpenSim as well, where only CMCTool has a property for it.
"""
MAX_SHIFT_M = 0.1
"""Largest shift of a mass centre along an axis, m; the limit of OpenSim."""


def run_rra_tool(job: Job, outcome: Outcome) -> None:
    """Move the mass centre if requested, follow the motion, and write the average residuals.

    Args:
        job: setup, an RRATool.
        outcome: outcome to which the results are added.
    """
    setup: RRATool = job.setup
    model = build_model(job)
    file_model = job.read_model()
    with build_simulation(job, model) as simulation:
        desired = DesiredMotion.read(job, outcome, simulation, model)
    # The desired motion has coordinates only, so that it remains valid when a mass centre moves.
    if setup.adjust_com_to_reduce_residuals:
        _move_mass_center(job, outcome, model, file_model, desired)
        outcome.add_text(
            _get_model_output(job, setup.output_model_file.strip()), to_text(file_model)
        )
    motion = _track_motion(job, outcome, model, desired, RRA_WINDOW_S, exact=False)
    if motion is None:
        return
    # These averages are over the followed motion; those of the mass centre are over the desired
    # one.
    forces = outcome.tables[f"{setup.name}_Actuation_force.sto"]
    averages = _average_residual_columns(forces.times, forces.columns, forces.rows)
    outcome.summary["average_residuals"] = dict(zip(RESIDUALS, averages, strict=True))
    if description := _describe_residuals(averages):
        outcome.add_message("average residuals", description)
    lines = "".join(
        f"{name} average = {value:g}\n" for name, value in zip(RESIDUALS, averages, strict=True)
    )
    outcome.add_text(
        job.get_results_path(f"{setup.name}_avgResiduals.txt"), f"Average Residuals:\n\n{lines}"
    )


def _move_mass_center(
    job: Job, outcome: Outcome, model: Model, file_model: Model, desired: DesiredMotion
) -> None:
    """Move the mass centre of a body so that average moments about the horizontal axes vanish.

    As in OpenSim, the masses that would remove the vertical residual are reported, but not changed.

    Args:
        job: setup of the tool, with the paths of its files.
        outcome: outcome to which messages are added.
        model: model with the forces of the setup, which is changed.
        file_model: model as in its file, which is changed.
        desired: motion to follow.
    """
    setup: RRATool = job.setup
    name = str(setup.adjusted_com_body)
    bodies = {body.name: body for body in model.components(Body)}
    if name not in bodies:
        raise job.create_error(
            f"adjusted_com_body is '{name}', which is not a body of the "
            f"model{suggest_name(name, bodies)}"
        )
    body = bodies[name]
    gravity = model.gravity
    weight = abs(gravity[1]) * body.mass
    # Simbody's SignificantReal.
    if weight < 2.0**-45.5:
        outcome.add_message(
            "mass center", f"'{name}' has no weight, so its mass centre is not moved, as in OpenSim"
        )
        return
    # The weight W acts along -y, so that a mass centre that moves by (x, 0, z) adds the moments z W
    # about x and -x W about z; these are to replace the residual moments.
    averages_before = _compute_average_residuals(job, model, desired)
    dx, dz = np.clip(
        [averages_before[5] / weight, -averages_before[3] / weight], -MAX_SHIFT_M, MAX_SHIFT_M
    ).tolist()
    x, y, z = body.mass_center
    # `file_model`, which is written, lacks the actuators that the setup adds to `model`.
    for changed_model in (model, file_model):
        next(
            candidate for candidate in changed_model.components(Body) if candidate.name == name
        ).mass_center = (
            x - dx,
            y,
            z - dz,
        )
    total = sum(candidate.mass for candidate in bodies.values())
    # The vertical residual is carried by a mass of this size.
    change = averages_before[1] / gravity[1]
    outcome.summary |= {"mass_center_moved": [-dx, 0.0, -dz], "mass_change": change}
    outcome.add_message(
        "mass center", f"of {name} moved by {-dx:.4g} m along x and {-dz:.4g} m along z"
    )
    outcome.add_message(
        "mass",
        f"{total:.6g} kg; {'add' if change > 0 else 'remove'} {abs(change):.4g} kg to remove the vertical residual "
        "(not applied, as in OpenSim)",
    )
    for moment_name, averages in (
        ("before", averages_before),
        ("after", _compute_average_residuals(job, model, desired)),
    ):
        outcome.add_message(f"residuals {moment_name}", _describe_residuals(averages))


def _compute_average_residuals(job: Job, model: Model, desired: DesiredMotion) -> list[float]:
    """Return the average residuals of the desired motion between the times of the setup."""
    setup: RRATool = job.setup
    mechanism: Mechanism = build_mechanism(model, opensim_derivatives=True)
    sharing = build_static_optimization(job, model, mechanism, muscles="isometric")
    requested_range = setup.initial_time_for_com_adjustment, setup.final_time_for_com_adjustment
    desired_range = max(setup.initial_time, desired.start), min(setup.final_time, desired.end)
    # -1, the default of both times, means that none is given.
    start, end = desired_range if requested_range == (-1.0, -1.0) else requested_range
    # As in OpenSim, a time means the last row that is not later.
    rows = [
        max(0, int(np.searchsorted(desired.times, time, side="right")) - 1) for time in (start, end)
    ]
    selected = slice(rows[0], rows[1] + 1)
    times = desired.times[selected]
    values = desired.values[selected]
    speeds = desired.speeds[selected]
    (accelerations,) = derivatives_of_samples(desired.times, desired.speeds, times, (1,))
    forces = sharing.balance_accelerations(times, values, speeds, accelerations)
    return _average_residual_columns(times, sharing.names, forces)


def run_cmc_tool(job: Job, outcome: Outcome) -> None:
    """Follow the motion window by window; write controls, states and forces.

    Args:
        job: setup, a CMCTool.
        outcome: outcome to which the results are added.
    """
    setup: CMCTool = job.setup
    if setup.actuators_to_exclude:
        raise job.create_unsupported_error(
            "osimlite does not support actuators_to_exclude, because it controls all actuators; leave "
            "the property empty"
        )
    if not setup.cmc_time_window > 0.0:
        raise job.create_error(
            f"cmc_time_window is {setup.cmc_time_window:g} s, expected more than 0; 0.01 s is usual"
        )
    model = build_model(job)
    with build_simulation(job, model) as simulation:
        desired = DesiredMotion.read(job, outcome, simulation, model)
    _track_motion(
        job, outcome, model, desired, setup.cmc_time_window, setup.use_fast_optimization_target
    )


RESIDUALS = "FX", "FY", "FZ", "MX", "MY", "MZ"
"""Names of the actuators that OpenSim takes for residual forces and moments of the pelvis."""


def _track_motion(
    job: Job, outcome: Outcome, model: Model, desired: DesiredMotion, window: float, exact: bool
) -> Motion | None:
    """Let a model follow a motion, and add the files that OpenSim writes.

    Args:
        job: setup of the tool, with the paths of its files.
        outcome: outcome to which the results are added.
        model: model with the forces of the setup.
        desired: motion to follow.
        window: length of the windows in which controls are computed, s.
        exact: whether the accelerations must be met exactly.

    Returns:
        The motion; None if it does not begin.
    """
    setup: RRATool | CMCTool = job.setup
    refuse_controllers(job, model)
    analyses = find_analyses(job)
    # OpenSim adds both analyses to every RRATool and CMCTool: their tables are the results.
    present_classes = {type(item) for item, _ in analyses}
    for cls in (Actuation, Kinematics):
        if cls not in present_classes:
            setup.analysis_set.objects.append(cls(name=cls.__name__))
    for item in setup.analysis_set.objects:
        if isinstance(item, Kinematics):
            item.in_degrees = True
    analyses = find_analyses(job)
    start = max(setup.initial_time, desired.start)
    end = min(setup.final_time, desired.end)
    # Controls follow from the desired pose at the end of their window, so that the last window must
    # end within the motion.
    if not start < end - window:
        raise job.create_error(
            f"the motion from {start:g} s to {end:g} s is shorter than a window of {window:g} s; "
            "set a later final_time"
        )
    with build_simulation(job, model) as simulation:
        tasks = TrackingTasks.read(job, simulation.mechanism)
        sharing = ForceDistribution(job, model, simulation.mechanism, tasks, exact)
        controls = _create_controls(job, sharing, model)
        tracker = ComputedControl(job, simulation, desired, tasks, sharing, controls, window)
        y = _compute_first_state(job, simulation, desired, start)
        followed = TrackedMotion()
        # The desired motion says nothing about the states of muscles, which therefore settle first.
        if tracker.has_states:
            start, y = tracker.settle_muscles(start, y, followed)
        if not followed.failure:
            bounds = setup.minimum_integrator_step_size, setup.maximum_integrator_step_size
            settings = EngineSettings(accuracy=setup.integrator_error_tolerance, step_bounds=bounds)
            settling_errors = followed.errors
            followed = tracker.follow_motion(start, y, end - window, settings)
            followed.errors = settling_errors | followed.errors
        if followed.failure:
            outcome.done = False
            outcome.add_message("ended early", followed.failure)
        if len(followed.times) < 2:
            return None
        # Analyses evaluate the controls at all times, and not only in the last window.
        tracker.drive_all_windows()
        moments = list(zip(followed.times, followed.states, strict=True))
        motion = Motion(
            model, simulation, np.array(followed.times), np.array(followed.states), moments
        )
        _write_tables(job, outcome, tracker, motion, followed)
        compute_analyses(job, outcome, analyses, motion)
        _report_errors(job, outcome, motion, followed)
    return motion


def _create_controls(job: Job, sharing: ForceDistribution, model: Model) -> list[ActuatorControl]:
    """Return a control for each actuator, with the bounds of the setup."""
    path = job.find_path("constraints_file")
    bounds_set = None if path is None else job.read_object(path, ControlSet)
    actuators = {item.name: item for item in model.force_set.objects}
    return [ActuatorControl.create(actuators[name], bounds_set) for name in sharing.names]


def _compute_first_state(
    job: Job, simulation: Simulation, desired: DesiredMotion, start: float
) -> list[float]:
    """Return the state (y,) of the desired motion at a time, with fibers as in the default pose.

    As in OpenSim, the state need not satisfy the constraints: the integrator projects it. The
    controls of the first window are computed before that, for the desired speeds, so that there is
    no speed error to correct.
    """
    in_equilibrium = (
        isinstance(job.setup, RRATool) or job.setup.solve_for_equilibrium_for_auxiliary_states
    )
    default = simulation.initial_state({}, {}, equilibrate=in_equilibrium)
    (desired_row,) = desired.evaluate(start)
    q, u = desired_row[0], desired_row[2]
    return simulation.state.pack(q.tolist(), u.tolist(), default[2 * len(simulation.state.order) :])


def _write_tables(
    job: Job, outcome: Outcome, tracker: ComputedControl, motion: Motion, followed: TrackedMotion
) -> None:
    """Add the tables of states, controls and errors, and the document of the controls."""
    name = job.setup.name
    precision = job.setup.output_precision

    def write_table(ending: str, table: StoTable) -> None:
        outcome.add_table(job.get_results_path(f"{name}_{ending}.sto"), table, precision=precision)

    paths = tuple(motion.simulation.paths)
    write_table(
        "states", StoTable(name, motion.times, paths, np.column_stack([*motion.histories.values()]))
    )
    labels = tuple(path.rpartition("/")[2] for path in motion.simulation.forces.controls.names)
    write_table(
        "controls",
        StoTable(
            "controls",
            motion.times,
            labels,
            motion.evaluate_kernels(motion.system.control_offsets),
        ),
    )
    columns = tuple(task.name for task in tracker.tasks.tasks)
    errors = StoTable(
        "PositionErrors",
        np.array([*followed.errors]),
        columns,
        np.array([*followed.errors.values()]),
    )
    write_table("pErr", errors)
    controls = ControlSet(
        name=motion.model.name, objects=[control.create_document() for control in tracker.controls]
    )
    outcome.add_text(
        job.get_results_path(f"{name}_controls.xml"), to_text(controls, numbers="opensim")
    )


def _report_errors(job: Job, outcome: Outcome, motion: Motion, followed: TrackedMotion) -> None:
    """Add messages about the largest errors of angles and translations."""
    report_rows(job, outcome, motion)
    errors = np.abs([*followed.errors.values()])
    infos = motion.mechanism.coordinates
    turning = [info.name for info in infos if info.motion_type == "rotational"]
    table = outcome.tables[f"{job.setup.name}_pErr.sto"]
    for quantity, unit, factor, selected in (
        ("angle", "deg", np.degrees(1.0), [k for k, n in enumerate(table.columns) if n in turning]),
        ("translation", "m", 1.0, [k for k, n in enumerate(table.columns) if n not in turning]),
    ):
        if selected:
            worst_column = int(np.argmax(errors[:, selected].max(axis=0)))
            largest = factor * float(errors[:, selected].max())
            outcome.summary[f"worst_{quantity}"] = largest
            outcome.add_message(
                f"{quantity} error",
                f"at most {largest:.3g} {unit} ({table.columns[selected[worst_column]]})",
            )


def _average_residual_columns(times: Array, columns: tuple[str, ...], rows: Array) -> list[float]:
    """Return time averages of the residual columns, 0 for those that are missing."""
    if len(times) < 2:
        return [0.0] * len(RESIDUALS)
    # The integrator's steps differ in length, so that a mean of the rows would not be an average
    # over time.
    areas = np.trapezoid(rows, times, axis=0) / (times[-1] - times[0])
    return [float(areas[columns.index(name)]) if name in columns else 0.0 for name in RESIDUALS]


def _describe_residuals(averages: list[float]) -> str:
    """Return average residuals, which are forces (FX) and moments (MX), in words."""
    return ", ".join(
        f"{name} {value:.4g} {'N' if name.startswith('F') else 'N m'}"
        for name, value in zip(RESIDUALS, averages, strict=True)
        if value
    )


def _get_model_output(job: Job, name: str) -> Path:
    """Return the path of the changed model."""
    return job.get_output_path(name or "adjusted_model.osim")
