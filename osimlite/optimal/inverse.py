"""MocoInverse: controls of actuators for a prescribed motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from osimlite.base.records import replace
from osimlite.base.text import append_clause, suggest_name
from osimlite.fitting.modifying.operators import process_model
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.optimal.ipopt import Progress
from osimlite.optimal.prescribed_motion import PrescribedMotion
from osimlite.optimal.problem import Problem
from osimlite.optimal.program import Program
from osimlite.optimal.refinement import Refinement
from osimlite.optimal.solution import MocoSolution, solve_program
from osimlite.optimal.study_context import StudyContext
from osimlite.optimal.tables import SplineCurves, check_columns, process_table
from osimlite.optimal.tool_study import make_study, set_time_range
from osimlite.schema.moco.goals import (
    MocoControlGoal,
    MocoInitialActivationGoal,
    MocoSumSquaredStateGoal,
)
from osimlite.schema.moco.parts import MocoWeight, MocoWeightSet
from osimlite.schema.moco.studies import MocoCasADiSolver, MocoInverse, MocoStudy
from osimlite.schema.model import Model
from osimlite.schema.tools.processors import TabOpUseAbsoluteStateNames

TENDON_RATE_WEIGHT = 0.01
"""Weight of the squared rates of tendon forces, as in MocoInverse."""


def build_inverse_problem(
    tool: MocoInverse,
    file: Path | None = None,
    folder: Path | None = None,
    more: Callable[[MocoStudy], None] | None = None,
    scaled: Mapping[str, str] | None = None,
) -> Problem:
    """Build the optimal control problem of a MocoInverse.

    Args:
        tool: settings.
        file: setup file of the settings; None for settings that were not read from a file.
        folder: folder of the files that the settings name, for settings without a file; the current
            folder if None.
        more: function that changes the study before the problem is built: goals, bounds, solver;
            None for no change.
        scaled: column of a table for each scale factor of a goal, see :func:`osimlite.moco.solve`.

    Returns:
        Problem whose functions are a :class:`~osimlite.optimal.prescribed_motion.PrescribedMotion`.

    Raises:
        OsimliteError: the settings or their files are invalid.
    """
    context = StudyContext(file, folder)
    model = process_model(tool.model, context.folder)
    solver = MocoCasADiSolver(
        name="solver",
        multibody_dynamics_mode="implicit",
        interpolate_control_mesh_interior_points=False,
        minimize_implicit_auxiliary_derivatives=True,
        implicit_auxiliary_derivatives_weight=TENDON_RATE_WEIGHT,
        optim_convergence_tolerance=tool.convergence_tolerance,
        optim_constraint_tolerance=tool.constraint_tolerance,
        # Moco uses limited memory, with which a search ends up to 1e-3 above the optimum.
        optim_hessian_approximation="exact",
        optim_sparsity_detection="random",
        optim_finite_difference_scheme="forward",
    )
    if tool.max_iterations is not None:
        solver.optim_max_iterations = tool.max_iterations
    study = make_study(tool, model, solver)
    phase = study.problem.phases
    # ModOpAddReserves names its actuators so. They are weighted apart, as they must not replace muscles.
    reserves = MocoWeight(name=".*/reserve_.*", weight=tool.reserves_weight)
    effort = MocoControlGoal(name="excitation_effort")
    effort.control_weights_pattern = MocoWeightSet(
        name="control_weights_pattern", objects=[reserves]
    )
    phase.goals += [effort, MocoInitialActivationGoal(name="initial_activation")]
    if tool.minimize_sum_squared_activations:
        phase.goals.append(
            MocoSumSquaredStateGoal(name="activation_effort", pattern=".*activation$")
        )
    table, motion = _read_kinematics(context, tool, model)
    set_time_range(context, tool, [table], study)
    if more is not None:
        more(study)
    problem = Problem(study, file, folder, motion=motion, scaled=scaled)
    if not tool.kinematics_allow_extra_columns:
        known_columns = (
            *problem.functions.tabulate_states(table.times[:1]),
            *problem.functions.states,
        )
        for label in table.columns:
            if label not in known_columns:
                raise context.invalid_error(
                    tool,
                    append_clause(
                        f"'{label}' is not a state{suggest_name(label, known_columns)}",
                        "set kinematics_allow_extra_columns to ignore it",
                    ),
                )
    return problem


def solve_inverse(
    tool: MocoInverse,
    *,
    folder: str | Path | None = None,
    more: Callable[[MocoStudy], None] | None = None,
    tell: Callable[[Progress], None] | None = None,
    refine: float | str | Refinement | None = None,
    scaled: Mapping[str, str] | None = None,
) -> MocoSolution:
    """Find the controls of muscles and other actuators for a prescribed motion, as OpenSim's MocoInverse.

    Args:
        tool: settings.
        folder: folder of the files that the settings name; the current folder if None.
        more: function that changes the study before it is solved: goals, bounds, solver; None for
            no change.
        tell: function that is called with the progress after each iteration; None for none.
        refine: accuracy or settings of mesh refinement, see :func:`osimlite.moco.solve`.
        scaled: column of a table for each scale factor of a goal, see :func:`osimlite.moco.solve`.

    Returns:
        Solution, whose states include the values and speeds of the prescribed motion.

    Raises:
        OsimliteError: as for :func:`build_inverse_problem`.
    """
    problem = build_inverse_problem(
        tool, None, None if folder is None else Path(folder), more, scaled
    )
    return solve_inverse_problem(problem, tell, refine)


def solve_inverse_problem(
    problem: Problem,
    tell: Callable[[Progress], None] | None,
    refine: float | str | Refinement | None = None,
) -> MocoSolution:
    """Solve the problem of a MocoInverse.

    Args:
        problem: problem of :func:`build_inverse_problem`.
        tell: function that is called with the progress after each iteration.
        refine: accuracy or settings of mesh refinement, see :func:`osimlite.moco.solve`.

    Returns:
        Solution, whose states include the values and speeds of the prescribed motion.
    """
    motion: PrescribedMotion = problem.functions
    solution = solve_program(Program(problem), None, tell, refine)
    trajectory = solution.trajectory
    states = motion.tabulate_states(trajectory.times)
    names = trajectory.names | {"states": (*trajectory.names["states"], *states)}
    return replace(
        solution, trajectory=replace(trajectory, columns=states | trajectory.columns, names=names)
    )


def _read_kinematics(
    context: StudyContext, tool: MocoInverse, model: Model
) -> tuple[StoTable, Callable[[Array], Array]]:
    """Read the kinematics of a MocoInverse.

    Args:
        context: tool with its folder, for messages.
        tool: settings.
        model: processed model.

    Returns:
        The table, and the motion of all coordinates: splines through poses that fulfil the model's
        constraints.
    """
    mechanism = build_mechanism(model)
    infos = mechanism.coordinates
    names = [f"{info.path}/value" for info in infos]
    states = [*names, *(f"{info.path}/speed" for info in infos)]
    # OpenSim accepts names of coordinates, and old names of states, as paths of states.
    processor = tool.kinematics.copy_deep()
    processor.operators.append(TabOpUseAbsoluteStateNames())
    table = process_table(context, tool.kinematics, processor, states, mechanism)
    tracked = [name for name in names if name in table.columns]
    if not tracked:
        raise context.invalid_error(
            tool,
            "kinematics has no column with a coordinate of the model, such as "
            + (names[0] if names else "a coordinate"),
        )
    check_columns(table, tracked)
    values = np.tile([info.default_value for info in infos], (len(table.times), 1))
    values[:, [names.index(name) for name in tracked]] = np.column_stack(
        [table[name] for name in tracked]
    )
    # Measured values fulfil the constraints only nearly, and coordinates without a column start at
    # their default value.
    poses = np.array(
        [mechanism.assemble(q, t) for t, q in zip(table.times.tolist(), values, strict=True)]
    )
    return table, SplineCurves(table.times, poses).evaluate
