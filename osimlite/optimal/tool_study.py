"""Parts of the studies that MocoInverse and MocoTrack make: the study itself, its times and its mesh."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from osimlite.io.tables.storage import StoTable
from osimlite.optimal.study_context import MAX_MESH_INTERVALS, StudyContext
from osimlite.schema.moco.parts import MocoFinalBounds, MocoInitialBounds
from osimlite.schema.moco.studies import (
    MocoCasADiSolver,
    MocoInverse,
    MocoPhase,
    MocoProblem,
    MocoStudy,
    MocoTrack,
)
from osimlite.schema.model import Model
from osimlite.schema.tools.processors import ModelProcessor


def make_study(tool: MocoInverse | MocoTrack, model: Model, solver: MocoCasADiSolver) -> MocoStudy:
    """Return a study of a processed model without goals.

    Args:
        tool: tool that names the study.
        model: processed model.
        solver: solver of the study.
    """
    phase = MocoPhase(name="phases", model=ModelProcessor(name="model", model=model))
    return MocoStudy(
        name=tool.name, problem=MocoProblem(name="problem", phases=phase), solver=solver
    )


def set_time_range(
    context: StudyContext,
    tool: MocoInverse | MocoTrack,
    tables: Sequence[StoTable],
    study: MocoStudy,
) -> tuple[float, float]:
    """Set bounds of time and the mesh of a study by the settings of a tool.

    Args:
        context: tool with its folder, for messages.
        tool: settings.
        tables: reference tables, which the motion must not exceed.
        study: study to change.

    Returns:
        Initial and final time, s.

    Raises:
        DocumentError: the tables have no data between the times of the tool, or the mesh is too
            fine.
    """
    first_time = max(float(table.times[0]) for table in tables)
    last_time = min(float(table.times[-1]) for table in tables)
    start = first_time if tool.initial_time is None else tool.initial_time
    end = last_time if tool.final_time is None else tool.final_time
    if not first_time <= start < end <= last_time:
        message = f"the tables cover {first_time:g} s to {last_time:g} s, not the motion from {start:g} s to {end:g} s"
        raise context.invalid_error(tool, message)
    assert isinstance(study.solver, MocoCasADiSolver)
    # For a tiny interval the quotient below would overflow.
    if (
        not 0.0 < tool.mesh_interval < np.inf
        or (end - start) / MAX_MESH_INTERVALS > tool.mesh_interval
    ):
        message = f"mesh_interval is {tool.mesh_interval:g} s; the maximum is {MAX_MESH_INTERVALS} intervals"
        raise context.invalid_error(tool, message)
    study.solver.num_mesh_intervals = math.ceil((end - start) / tool.mesh_interval)
    if tool.clip_time_range:
        # Moco's margin, s, for finite differences about the ends of the motion.
        start = start + 1e-3
        end = end - 1e-3
    phase = study.problem.phases
    phase.time_initial_bounds = MocoInitialBounds(name="time_initial_bounds", bounds=(start,))
    phase.time_final_bounds = MocoFinalBounds(name="time_final_bounds", bounds=(end,))
    return start, end
