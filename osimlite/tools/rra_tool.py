"""OpenSim's RRATool: a motion that the measured forces explain, with a mass centre that goes with it."""

from __future__ import annotations

import numpy as np

from osimlite.base.text import did_you_mean
from osimlite.io.document.printer import to_text
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.smoothing_spline import derivatives_of_samples
from osimlite.schema.frames import Body
from osimlite.schema.model import Model
from osimlite.schema.tools.tracking import RRATool
from osimlite.tools.job import Job
from osimlite.tools.outcome import Outcome
from osimlite.tools.through_time import sharing_of, simulation_of, told_model
from osimlite.tools.tracked import RESIDUALS, average_residuals, model_file, residual_words, track
from osimlite.tools.tracking import Desired

WINDOW = 1e-3
"""For which controls are computed, s."""
FARTHEST = 0.1
"""A mass centre is moved by no more than this, m."""


def run(job: Job, outcome: Outcome) -> None:
    """Move the mass centre if that is asked for, then follow the motion, and write what residuals are left."""
    setup: RRATool = job.setup
    model, whole = told_model(job), job.model()
    with simulation_of(job, model) as simulation:
        desired = Desired.of(job, outcome, simulation, model)
    if setup.adjust_com_to_reduce_residuals:
        _move_mass_center(job, outcome, model, whole, desired)
        outcome.text(model_file(job, setup.output_model_file.strip()), to_text(whole))
    motion = track(job, outcome, model, desired, WINDOW, exact=False)
    if motion is None:
        return
    forces = outcome.tables[f"{setup.name}_Actuation_force.sto"]
    averages = average_residuals(forces.times, forces.columns, forces.rows)
    outcome.summary["average_residuals"] = dict(zip(RESIDUALS, averages, strict=True))
    if words := residual_words(averages):
        outcome.tell("average residuals", words)
    lines = "".join(
        f"{name} average = {value:g}\n" for name, value in zip(RESIDUALS, averages, strict=True)
    )
    outcome.text(job.in_results(f"{setup.name}_avgResiduals.txt"), f"Average Residuals:\n\n{lines}")


def _move_mass_center(
    job: Job, outcome: Outcome, model: Model, whole: Model, desired: Desired
) -> None:
    """Move the mass centre of a body in two models so that the moments about the horizontal axes average to nothing.

    The masses that would take the vertical force away are only told, as OpenSim does.
    """
    setup: RRATool = job.setup
    name = str(setup.adjusted_com_body)
    bodies = {body.name: body for body in model.components(Body)}
    if name not in bodies:
        raise job.error(
            f"adjusted_com_body is '{name}', which is no body of the model{did_you_mean(name, bodies)}"
        )
    body, gravity = bodies[name], model.gravity
    weight = abs(gravity[1]) * body.mass
    if weight < 2.0**-45.5:
        outcome.tell("mass center", f"'{name}' has no weight: it stays where it is, as in OpenSim")
        return
    before = _averages(job, model, desired)
    dx, dz = np.clip([before[5] / weight, -before[3] / weight], -FARTHEST, FARTHEST).tolist()
    x, y, z = body.mass_center
    for each in (model, whole):
        next(item for item in each.components(Body) if item.name == name).mass_center = (
            x - dx,
            y,
            z - dz,
        )
    total = sum(item.mass for item in bodies.values())
    change = before[1] / gravity[1]
    outcome.summary |= {"mass_center_moved": [-dx, 0.0, -dz], "mass_change": change}
    outcome.tell("mass center", f"of {name} moved by {-dx:.4g} m along x and {-dz:.4g} m along z")
    outcome.tell(
        "mass",
        f"{total:.6g} kg, and {change:+.4g} kg would take the vertical residual away; OpenSim leaves that to you",
    )
    for when, averages in (("before", before), ("after", _averages(job, model, desired))):
        outcome.tell(f"residuals {when}", residual_words(averages))


def _averages(job: Job, model: Model, desired: Desired) -> list[float]:
    """Averages of the residuals that the motion takes as it was measured, in the time of the setup."""
    setup: RRATool = job.setup
    mechanism: Mechanism = build_mechanism(model, opensim_derivatives=True)
    sharing = sharing_of(job, model, mechanism, muscles="isometric")
    given = setup.initial_time_for_com_adjustment, setup.final_time_for_com_adjustment
    own = max(setup.initial_time, desired.start), min(setup.final_time, desired.end)
    first, last = own if given == (-1.0, -1.0) else given
    rows = [
        max(0, int(np.searchsorted(desired.times, time, side="right")) - 1)
        for time in (first, last)
    ]
    chosen = slice(rows[0], rows[1] + 1)
    times, values, speeds = desired.times[chosen], desired.values[chosen], desired.speeds[chosen]
    (wanted,) = derivatives_of_samples(desired.times, desired.speeds, times, (1,))
    forces = sharing.balanced(times, values, speeds, wanted)
    return average_residuals(times, sharing.names, forces)
