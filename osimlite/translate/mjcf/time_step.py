"""Time step of a file: small enough for the stiffest springs of the model.

MuJoCo's step is fixed and ends in NaN where OpenSim takes smaller steps. The springs of a model,
linearized about its default pose, oscillate or decay at rates w (1/s); explicit steps longer than 2
/ w amplify this. MuJoCo integrates the damping of joints and tendons implicitly, but that of a
bushing acts through a weld. Muscles are not linearized: their stiff part is the tendon, which is
rigid in MuJoCo.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from osimlite.errors import OsimliteError
from osimlite.mechanics.kernels.constrained_dynamics import SAFE_MASS
from osimlite.mechanics.multibody.linear import solve_with_null_space, stack_equations
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.forces import CoordinateLimitForce, Force
from osimlite.schema.muscles import Muscle
from osimlite.schema.path_forces import Blankevoort1991Ligament, Ligament, PathSpring
from osimlite.schema.springs import BushingForce, PointToPointSpring, SpringGeneralizedForce
from osimlite.simulation.elements import ElementBuilder, Forces
from osimlite.simulation.elements.force_records import ForceElement
from osimlite.simulation.system import System
from osimlite.translate.mjcf.draft import MjcfDraft, format_value
from osimlite.translate.mjcf.isometric import compute_isometric_tension

SPRING_TYPES = (
    Blankevoort1991Ligament,
    BushingForce,
    CoordinateLimitForce,
    Ligament,
    PathSpring,
    PointToPointSpring,
    SpringGeneralizedForce,
)
"""Classes of forces that are linearized."""
DEFAULT_STEP_S = 1e-3
"""Time step (s) if no spring is too stiff."""
DIFFERENCE_STEP = 1e-7
"""Change of coordinates (rad or m) or speeds in central differences."""


def choose_step(draft: MjcfDraft) -> None:
    """Reduce the time step where springs are stiff, and warn about overstretched muscles."""
    try:
        rate = _compute_fastest_rate(draft)
    except OsimliteError as error:
        rate = 0.0
        description = "springs that may be too stiff; their stiffness cannot be computed"
        draft.fidelity.add(
            "stiff",
            "/",
            description,
            f"steps of {DEFAULT_STEP_S:g} s, which may be too long",
            error.message,
        )
    if rate * DEFAULT_STEP_S > 2.0:
        # Half of the stability limit, with one digit.
        step = float(f"{1.0 / rate:.0e}")
        next(draft.root.iter("option")).set("timestep", format_value(step))
        description = (
            f"springs that are too stiff for steps of {DEFAULT_STEP_S:g} s; states would become NaN"
        )
        detail = f"{step:g} s, because the fastest rate near the default pose is {rate:.3g} 1/s"
        draft.fidelity.add("stiff", "/", description, "the file sets smaller steps", detail)
    for path, path_tendon in draft.tendons.items():
        muscle = draft.tree.by_path[path]
        tension = 0.0
        if isinstance(muscle, Muscle) and _is_translated(draft, muscle):
            with suppress(OsimliteError):
                (tension,) = compute_isometric_tension(
                    muscle, np.array((path_tendon.default,)), (0.0,)
                )[0]
            # Passive tension above the strength: the default pose is beyond the range of the
            # fibers.
            if tension > muscle.max_isometric_force:
                description = "fibers that are stretched too far in the default pose"
                consequence = (
                    "written unchanged: the simulation may diverge, even with smaller steps"
                )
                detail = f"their passive force is {tension / muscle.max_isometric_force:.2g} times max_isometric_force"
                draft.fidelity.add("overstretched", path, description, consequence, detail)


def _is_translated(draft: MjcfDraft, force: Force) -> bool:
    """Return whether a force is in the file."""
    return draft.tree.path_of(force) in draft.fidelity.translated


def _compute_fastest_rate(draft: MjcfDraft) -> float:
    """Return the largest rate (1/s) of the springs about the default pose.

    It is the largest magnitude of the eigenvalues of the linearized motion in directions that the
    constraints allow.
    """
    mechanism, (q, u) = draft.mechanism, draft.default_state
    state = mechanism.at(q, u)
    rows = np.zeros((0, len(u)))
    free_motions = np.eye(len(u))
    if mechanism.constraints:
        rows, _ = stack_equations(
            [constraint.velocity_equations(state) for constraint in mechanism.constraints]
        )
        # Only motions that the constraints allow.
        _, free_motions = solve_with_null_space(rows, np.zeros(len(rows)))
    mass = free_motions.T @ mechanism.mass_matrix(q) @ free_motions
    # A motion without inertia has no finite rate.
    if not len(mass) or np.linalg.eigvalsh(mass)[0] < SAFE_MASS:
        return 0.0
    builder = ElementBuilder(draft.model, mechanism, draft.folder or Path())
    # A spring that is left out needs no small steps; often its stiffness cannot be computed.
    owners = [
        force
        for force in builder.iterate_forces()
        if isinstance(force, SPRING_TYPES) and _is_translated(draft, force)
    ]
    springs = [builder.make_element(force) for force in owners]
    bushings = [
        spring
        for force, spring in zip(owners, springs, strict=True)
        if isinstance(force, BushingForce)
    ]
    zero = np.zeros_like(free_motions)
    stiffness = _differentiate_forces(draft, springs, mechanism.rate_matrix(q) @ free_motions, zero)
    damping = _differentiate_forces(draft, bushings, zero, free_motions)
    rates = np.linalg.solve(mass, free_motions.T @ np.hstack((stiffness, damping)))
    count = len(mass)
    return float(
        np.abs(np.linalg.eigvals(np.vstack((np.eye(count, 2 * count, count), rates)))).max()
    )


def _differentiate_forces(
    draft: MjcfDraft,
    elements: Sequence[ForceElement],
    coordinate_changes: Array,
    speed_changes: Array,
) -> Array:
    """Differentiate generalized forces by changes of coordinates and speeds.

    Args:
        draft: MJCF under construction.
        elements: force elements whose generalized forces are differentiated.
        coordinate_changes: directions of the coordinates (n, f).
        speed_changes: directions of the speeds (n, f).

    Returns:
        Derivatives (n, f).
    """
    q, u = draft.default_state
    result = np.zeros_like(coordinate_changes)
    if elements:
        system = System(draft.mechanism, Forces(tuple(elements)))
        order = list(system.order)

        def forces(step: float, k: int) -> Array:
            row = np.zeros(len(result))
            y = system.state.pack(
                (q + step * coordinate_changes[:, k]).tolist(),
                (u + step * speed_changes[:, k]).tolist(),
            )
            row[order] = system.compute_applied_forces(0.0, y)[len(order) : 2 * len(order)]
            return row

        for k in range(result.shape[1]):
            result[:, k] = (forces(DIFFERENCE_STEP, k) - forces(-DIFFERENCE_STEP, k)) / (
                2.0 * DIFFERENCE_STEP
            )
    return result
