"""Muscles along a trial: the forces of their passive fibers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from osimlite.io.tables.storage import StoTable
from osimlite.lint.trial import Number
from osimlite.schema.muscles import Muscle
from osimlite.schema.tools.analyses import MuscleAnalysis
from osimlite.schema.tools.dynamics import AnalyzeTool
from osimlite.tools.analyze_tool import run_analyze_tool
from osimlite.tools.job import Job
from osimlite.tools.outcome import Outcome
from osimlite.tools.trials.fit import Numbers
from osimlite.tools.trials.folder import MOTIONS, Missing, Tool

MOST_ROWS = 100
"""So many moments of a motion are looked at."""
LEAST = 1.0
"""What is less (% of the strength) is not told of each muscle."""


def passive_numbers(tool: Tool, states: Path | None) -> Numbers:
    """The largest passive force of each muscle in parts of its strength, along states or a motion."""
    file = states or tool.input("states_file") or tool.needed(*MOTIONS)
    is_states = states is not None or file == tool.input("states_file")
    table = passive_forces(tool, file, is_states=is_states)
    strengths = {
        muscle.name: float(muscle.max_isometric_force) for muscle in tool.model.components(Muscle)
    }
    told = 0
    for name in table.columns:
        column = np.where(np.isfinite(table[name]), table[name], 0.0)
        row = int(np.argmax(column))
        share = 100.0 * float(column[row]) / strengths[name] if strengths.get(name) else 0.0
        if share >= LEAST:
            told += 1
            time = float(table.times[row])
            at = tool.folder.at(file, time)
            of = f"the passive force of '{name}', of its strength"
            where = f"{column[row]:.4g} N at {time:g} s"
            yield file, Number("passive-force", "peak", of, share, "%", where=where, at=at)
    if not told:
        yield (
            file,
            Number(
                "passive-force",
                "peak",
                "the passive force of any muscle, of its strength",
                0.0,
                "%",
            ),
        )


def passive_forces(tool: Tool, file: Path, *, is_states: bool) -> StoTable:
    """Forces (N) of the passive fibers of all muscles at some moments of a file."""
    times = tool.folder.table(file).times
    first, last = max(float(times[0]), tool.span[0]), min(float(times[-1]), tool.span[1])
    count = int(((times >= first) & (times <= last)).sum())
    if not count or not any(True for _ in tool.model.components(Muscle)):
        raise Missing(f"{tool} has no muscles, or '{file}' none of its times")
    analysis = MuscleAnalysis(name="muscles", moment_arm_coordinate_list=(), compute_moments=False)
    analysis.step_interval = max(1, count // MOST_ROWS)
    setup = AnalyzeTool(
        name="trial",
        model_file=str(tool.model_file.absolute()),
        initial_time=first,
        final_time=last,
    )
    setup.solve_for_equilibrium_for_auxiliary_states = not is_states
    setattr(setup, "states_file" if is_states else "coordinates_file", str(file.absolute()))
    setup.lowpass_cutoff_frequency_for_coordinates = -1.0 if is_states else tool.cutoff
    setup.analysis_set.objects.append(analysis)
    outcome = Outcome()
    run_analyze_tool(Job(setup, tool.job.file), outcome)
    return outcome.tables["trial_muscles_PassiveFiberForce.sto"]
