"""OpenSim's analyses of muscles: MuscleAnalysis and StaticOptimization."""

from __future__ import annotations

import numpy as np

from osimlite.base.text import add_article
from osimlite.io.tables.old_storage import UNITS
from osimlite.io.tables.writers import format_control_set
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.muscles import Muscle
from osimlite.schema.tools.analyses import MuscleAnalysis, StaticOptimization
from osimlite.simulation.elements.muscle import SPRING
from osimlite.simulation.paths import Paths
from osimlite.simulation.shared_forces import SharedForces
from osimlite.tools.analyses.reporters import FORCES_DESCRIPTION
from osimlite.tools.dynamics_setup import build_static_optimization
from osimlite.tools.motion import AnalysisTables, Motion
from osimlite.tools.muscle_quantities import (
    CORRECTIONS,
    DYNAMIC_QUANTITIES,
    LAW_RECORDS,
    compute_quantities,
)

MUSCLE_DESCRIPTION = (
    "\nThis analysis gathers basic information about muscles during a simulation "
    f"(e.g., forces, tendon lengths, moment arms, etc).\n{UNITS}"
)
"""OpenSim's text in the header of the tables."""


def write_muscle_analysis(analysis: MuscleAnalysis, motion: Motion, tables: AnalysisTables) -> None:
    """Write a table for each quantity of muscles, and two for each coordinate.

    Args:
        analysis: settings of the analysis.
        motion: motion along which the analysis is computed.
        tables: writer of the tables.
    """
    all_muscles = list(motion.model.components(Muscle))
    selected = motion.find_indices(
        analysis.muscle_list,
        [muscle.name for muscle in all_muscles],
        f"muscles of '{analysis.name}'",
    )
    muscles = [all_muscles[index] for index in selected]
    for muscle in muscles:
        # Corrections reproduce OpenSim's numbers; they are known for certain classes only.
        reason = "which osimlite cannot analyse yet" if type(muscle) not in CORRECTIONS else ""
        reason = reason or ("" if muscle.appliesForce else "whose appliesForce is false")
        if reason:
            raise tables.job.create_unsupported_error(
                f"'{analysis.name}' requests '{muscle.name}', {add_article(type(muscle).__name__)}, {reason}"
            )
    names = [muscle.name for muscle in muscles]
    result = _compute_tables(motion, muscles)
    # As in OpenSim, which evaluates these quantities only if the model has mass.
    if not motion.mechanism.total_mass > np.finfo(float).eps:
        result |= {suffix: np.full_like(result[suffix], np.nan) for suffix in DYNAMIC_QUANTITIES}
    for suffix, rows in result.items():
        tables.add_table(suffix, suffix, names, rows, description=MUSCLE_DESCRIPTION)
    if analysis.compute_moments:
        _add_moments(analysis, motion, tables, muscles, result["TendonForce"])


def _compute_tables(motion: Motion, muscles: list[Muscle]) -> dict[str, Array]:
    """Return the tables (t, m) of muscles of any classes."""
    result: dict[str, Array] = {}
    tree = motion.model.tree()
    # Corrections differ between classes; all muscles of a class are computed at once.
    for cls in dict.fromkeys(map(type, muscles)):
        indices = [index for index, muscle in enumerate(muscles) if type(muscle) is cls]
        paths = [tree.path_of(muscles[index]) or "" for index in indices]
        names = (
            LAW_RECORDS
            if not motion.system.has_quantity(paths[0], SPRING)
            else (*LAW_RECORDS, SPRING)
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            of_class = compute_quantities(
                motion.read_records(paths, *names), [muscles[index] for index in indices]
            )
        for suffix, rows in of_class.items():
            result.setdefault(suffix, np.empty((len(motion.times), len(muscles))))[:, indices] = (
                rows
            )
    return result


def _add_moments(
    analysis: MuscleAnalysis,
    motion: Motion,
    tables: AnalysisTables,
    muscles: list[Muscle],
    tension: Array,
) -> None:
    """Write the tables of moment arms and moments about coordinates."""
    infos = motion.mechanism.coordinates
    tree = motion.model.tree()
    paths = Paths(motion.model)
    rows = [paths.names.index(tree.path_of(muscle) or "") for muscle in muscles]
    arms = paths.compute_moment_arms(motion.values)[:, rows]
    requested = [
        "all" if str(name).lower() == "all" else name
        for name in analysis.moment_arm_coordinate_list
    ]
    for index in motion.find_indices(
        requested, [info.name for info in infos], f"coordinates of '{analysis.name}'"
    ):
        names = [muscle.name for muscle in muscles]
        coordinate_arms = arms[:, :, index]
        for quantity, result in (
            ("MomentArm", coordinate_arms),
            ("Moment", coordinate_arms * tension),
        ):
            title = f"{quantity}_{infos[index].name}"
            tables.add_table(title, title, names, result, description=MUSCLE_DESCRIPTION)


ACTIVATION_DESCRIPTION = "This file contains static optimization results.\n"
"""OpenSim's text in the header of the activations."""


def write_static_optimization(
    analysis: StaticOptimization, motion: Motion, tables: AnalysisTables
) -> None:
    """Write activations, forces and controls; NaN at times without a solution.

    Args:
        analysis: settings of the analysis.
        motion: motion along which the analysis is computed.
        tables: writer of the tables.
    """
    job = tables.job
    if motion.record is None:
        raise job.create_unsupported_error(
            f"'{analysis.name}' needs a measured motion; use it in an AnalyzeTool"
        )
    if not analysis.use_model_force_set:
        raise job.create_unsupported_error(
            f"OpenSim crashes without use_model_force_set; set it to true in '{analysis.name}'"
        )
    muscles = "active" if analysis.use_muscle_physiology else "isometric"
    problem = build_static_optimization(
        job, motion.model, motion.mechanism, exponent=analysis.activation_exponent, muscles=muscles
    )
    shared_forces = problem.solve_motion(
        motion.times, motion.values, motion.speeds, motion.measured_accelerations
    )
    forces = problem.report_forces(shared_forces, motion.values, motion.speeds)
    activations = shared_forces.to_table()
    tables.add_table(
        "activation",
        activations.name,
        activations.columns,
        activations.rows,
        description=ACTIVATION_DESCRIPTION,
    )
    tables.add_table(
        "force", forces.name, forces.columns, forces.rows, description=FORCES_DESCRIPTION
    )
    tables.add_text("controls.xml", "".join(format_control_set(activations)))
    _report_unsolved(shared_forces, analysis.name, tables)


def _report_unsolved(shared_forces: SharedForces, name: str, tables: AnalysisTables) -> None:
    """Report the times without a solution, and the coordinates that lack strength there."""
    outcome = tables.outcome
    outcome.summary[f"{name}_unsolved"] = np.count_nonzero(~shared_forces.solved)
    if description := shared_forces.describe_unsolved():
        outcome.done = False
        outcome.add_message(name, description)
