"""Measurements of muscles in a trial: forces of the passive fibers."""

from __future__ import annotations

from math import ceil
from pathlib import Path

import numpy as np

from osimlite.io.tables.storage import StoTable
from osimlite.lint.trial import Measurement
from osimlite.schema.muscles import Muscle
from osimlite.schema.tools.analyses import MuscleAnalysis
from osimlite.schema.tools.dynamics import AnalyzeTool
from osimlite.tools.analyze_tool import run_analyze_tool
from osimlite.tools.job import Job
from osimlite.tools.outcome import Outcome
from osimlite.tools.trials.fit import Numbers
from osimlite.tools.trials.folder import MOTIONS, MissingInput, TrialTool

MAX_ROWS = 100
"""Number of times at which a motion is analysed, at most."""
MIN_PASSIVE_PERCENT = 1.0
"""Smallest passive force, in % of the strength, that is reported for a muscle."""


def measure_passive_forces(tool: TrialTool, states: Path | None) -> Numbers:
    """Yield the largest passive force of each muscle relative to its strength.

    Args:
        tool: tool with the model.
        states: file of states; None for the motion of the tool.
    """
    # States of a simulation have the actual fiber lengths; without them the fibers are in
    # equilibrium.
    file = states or tool.find_input("states_file") or tool.require_input(*MOTIONS)
    is_states = states is not None or file == tool.find_input("states_file")
    table = compute_passive_forces(tool, file, is_states=is_states)
    strengths = {
        muscle.name: float(muscle.max_isometric_force) for muscle in tool.model.components(Muscle)
    }
    reported_count = 0
    for name in table.columns:
        # A muscle without equilibrium has NaN.
        column = np.where(np.isfinite(table[name]), table[name], 0.0)
        row = int(np.argmax(column))
        percentage = 100.0 * float(column[row]) / strengths[name] if strengths.get(name) else 0.0
        if percentage >= MIN_PASSIVE_PERCENT:
            reported_count += 1
            time = float(table.times[row])
            position = tool.folder.locate_time(file, time)
            subject = f"the passive force of '{name}' relative to its max_isometric_force"
            force_note = f"{column[row]:.4g} N at {time:g} s"
            yield (
                file,
                Measurement(
                    "passive-force", "peak", subject, percentage, "%", where=force_note, at=position
                ),
            )
    if not reported_count:
        yield (
            file,
            Measurement(
                "passive-force",
                "peak",
                "the passive force of a muscle relative to its max_isometric_force",
                0.0,
                "%",
            ),
        )


def compute_passive_forces(tool: TrialTool, file: Path, *, is_states: bool) -> StoTable:
    """Return the forces (N) of the passive fibers of all muscles at some times.

    Args:
        tool: tool with the model.
        file: file of states or of a motion.
        is_states: whether the file has states.

    Raises:
        MissingInput: the model has no muscles, or the file has no row in the time range of the
            tool.
    """
    times = tool.folder.read_table(file).times
    start = max(float(times[0]), tool.span[0])
    end = min(float(times[-1]), tool.span[1])
    count = int(((times >= start) & (times <= end)).sum())
    if not count or not any(True for _ in tool.model.components(Muscle)):
        raise MissingInput(f"{tool} has no muscles, or '{file}' has no row in its time range")
    analysis = MuscleAnalysis(name="muscles", moment_arm_coordinate_list=(), compute_moments=False)
    # The largest force changes slowly, so that some rows suffice. As in OpenSim, the row before the
    # time range is analysed too.
    analysis.step_interval = ceil((count + 1) / MAX_ROWS)
    setup = AnalyzeTool(
        name="trial",
        model_file=str(tool.model_file.absolute()),
        initial_time=start,
        final_time=end,
    )
    setup.solve_for_equilibrium_for_auxiliary_states = not is_states
    setattr(setup, "states_file" if is_states else "coordinates_file", str(file.absolute()))
    setup.lowpass_cutoff_frequency_for_coordinates = -1.0 if is_states else tool.cutoff
    setup.analysis_set.objects.append(analysis)
    outcome = Outcome()
    run_analyze_tool(Job(setup, tool.job.file), outcome)
    return outcome.tables["trial_muscles_PassiveFiberForce.sto"]
