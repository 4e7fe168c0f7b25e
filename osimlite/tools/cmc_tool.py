"""OpenSim's CMCTool: excitations of muscles that make a model follow a motion (computed muscle control)."""

from __future__ import annotations

from osimlite.schema.tools.tracking import CMCTool
from osimlite.tools.job import Job
from osimlite.tools.outcome import Outcome
from osimlite.tools.through_time import simulation_of, told_model
from osimlite.tools.tracked import track
from osimlite.tools.tracking import Desired


def run(job: Job, outcome: Outcome) -> None:
    """Follow the motion window by window, and write controls, states and forces."""
    setup: CMCTool = job.setup
    if setup.actuators_to_exclude:
        raise job.unable(
            "actuators_to_exclude is given, and all actuators are controlled here; leave it empty"
        )
    model = told_model(job)
    with simulation_of(job, model) as simulation:
        desired = Desired.of(job, outcome, simulation, model)
    track(job, outcome, model, desired, setup.cmc_time_window, setup.use_fast_optimization_target)
