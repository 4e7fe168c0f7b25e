"""OpenSim's AnalyzeTool: analyses along a motion that is already known."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import Any

import numpy as np

from osimlite._load import module_name
from osimlite.multibody.spatial import Array
from osimlite.schema.controllers import ControllerSet
from osimlite.schema.forces import ForceSet
from osimlite.schema.model import Model
from osimlite.schema.tools.dynamics import AbstractTool, AnalyzeTool
from osimlite.simulation.files.recorded import RecordedMotion
from osimlite.simulation.run import Simulation
from osimlite.tools.job import Job
from osimlite.tools.motion import Motion, Tables
from osimlite.tools.not_runnable import NotRunnable
from osimlite.tools.outcome import Outcome

_ANALYSES = "osimlite.tools.analyses"


def run(job: Job, outcome: Outcome) -> None:
    """Compute every analysis that is on at every row of the motion between two times."""
    setup: AnalyzeTool = job.setup
    analyses = [(item, analysis_of(job, item)) for item in setup.analysis_set.objects if item.on]
    if job.path("states_file") is not None or job.path("speeds_file") is not None:
        raise NotRunnable(
            "a states_file or speeds_file cannot be analysed yet; give a coordinates_file", file=str(job.file)
        )
    model = told_model(job)
    loads = job.path("external_loads_file")
    with Simulation(model, "compiled", external_loads=loads, folder=job.needed("model_file").parent) as simulation:
        times, values, speeds = _followed(job, simulation)
        engine, rows = simulation.engine, []
        for t, q, u in zip(times.tolist(), values, speeds, strict=True):
            y = simulation.state.pack(q, u)
            rows.append(engine.equilibrated(t, y) if setup.solve_for_equilibrium_for_auxiliary_states else y)
        motion = Motion(model, simulation, times, np.array(rows))
        for item, module in analyses:
            module.compute(item, motion, Tables(job, outcome, item.name, times))
    outcome.tell("rows", f"{len(times)}, from {times[0]:g} s to {times[-1]:g} s")
    outcome.summary["rows"] = len(times)


def analysis_of(job: Job, analysis: Any) -> ModuleType:
    """The module of an analysis.

    Raises:
        NotRunnable: there is none, or it is to be done at some of the rows only.
    """
    tag = type(analysis).__name__
    name = f"{_ANALYSES}.{module_name(tag)}"
    if find_spec(name) is None:
        raise NotRunnable(
            f"the analysis '{analysis.name}' is a {tag}, which cannot be computed yet", file=str(job.file)
        )
    for field in ("step_interval", "start_time", "end_time"):
        if field in analysis.model_fields_set and not _is_whole(field, getattr(analysis, field), job.setup):
            told = f"{field} of '{analysis.name}' leaves rows out, which cannot be done yet"
            raise NotRunnable(told, file=str(job.file))
    return import_module(name)


def _is_whole(field: str, value: float, setup: AbstractTool) -> bool:
    if field == "step_interval":
        return value <= 1
    return value <= setup.initial_time if field == "start_time" else value >= setup.final_time


def told_model(job: Job) -> Model:
    """The model of a setup with the forces and controllers that the setup gives it."""
    setup: AbstractTool = job.setup
    model = job.model()
    if setup.replace_force_set:
        model.force_set.objects.clear()
    for name in setup.force_set_files:
        path = job.place(name)
        if path is not None:
            for force in list(job.read(path, ForceSet).objects):
                model.force_set.objects.append(force)
    controllers: ControllerSet = setup.controller_set
    if controllers.objects:
        raise NotRunnable("a setup with controllers of its own cannot be run yet", file=str(job.file))
    return model


def _followed(job: Job, simulation: Simulation) -> tuple[Array, Array, Array]:
    """Times (t,), values and speeds (t, n) of the coordinates of a setup."""
    setup: AnalyzeTool = job.setup
    recorded = RecordedMotion.read(simulation.mechanism, job.needed("coordinates_file"))
    cutoff = setup.lowpass_cutoff_frequency_for_coordinates
    if cutoff >= 0.0:
        recorded = recorded.lowpassed(cutoff, continued=True)
    if simulation.constraints:
        recorded = recorded.assembled()
    recorded = recorded.between(setup.initial_time, setup.final_time)
    # OpenSim takes the rates of coordinates for the speeds.
    return recorded.times, recorded.values, recorded.rates[0]
