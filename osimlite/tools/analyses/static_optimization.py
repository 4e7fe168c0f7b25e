"""OpenSim's StaticOptimization: how muscles and reserve actuators share what the motion takes."""

from __future__ import annotations

import numpy as np

from osimlite.io.tables.control_nodes import control_set
from osimlite.schema.tools.analyses import StaticOptimization
from osimlite.simulation.static_optimization import Shared
from osimlite.tools.analyses.force_reporter import DESCRIPTION
from osimlite.tools.motion import Motion, Tables
from osimlite.tools.through_time import sharing_of

_DESCRIPTION = "This file contains static optimization results.\n"


def compute(analysis: StaticOptimization, motion: Motion, tables: Tables) -> None:
    """Write activations, forces and controls; what has no solution is no number there, and told."""
    job = tables.job
    if motion.record is None:
        raise job.unable(
            f"'{analysis.name}' cannot be computed of a motion that was not measured; give it to an AnalyzeTool"
        )
    if not analysis.use_model_force_set:
        raise job.unable(
            f"'{analysis.name}' has use_model_force_set off, with which OpenSim crashes; set it to true"
        )
    muscles = "active" if analysis.use_muscle_physiology else "isometric"
    problem = sharing_of(
        job, motion.model, motion.mechanism, exponent=analysis.activation_exponent, muscles=muscles
    )
    shared = problem.share(motion.times, motion.values, motion.speeds, motion.wanted)
    forces = problem.records(shared, motion.values, motion.speeds)
    activations = shared.table()
    tables.add(
        "activation",
        activations.name,
        activations.columns,
        activations.rows,
        description=_DESCRIPTION,
    )
    tables.add("force", forces.name, forces.columns, forces.rows, description=DESCRIPTION)
    tables.add_text("controls.xml", "".join(control_set(activations)))
    tell(shared, analysis.name, tables)


def tell(shared: Shared, name: str, tables: Tables) -> None:
    """Say how it went: times without a solution, and what is missing there."""
    outcome = tables.outcome
    outcome.summary[f"{name}_unsolved"] = np.count_nonzero(~shared.solved)
    if said := shared.unsolved():
        outcome.done = False
        outcome.tell(name, said)
