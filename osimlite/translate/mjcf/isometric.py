"""Isometric tension of forces along paths by OpenSim's laws, and MuJoCo's active force over length."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from osimlite.errors import SimulationError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.controller_types import PrescribedController
from osimlite.schema.frames import Body
from osimlite.schema.functions import LinearFunction
from osimlite.schema.joints import SliderJoint
from osimlite.schema.model import Model
from osimlite.schema.muscles import Muscle
from osimlite.schema.paths import GeometryPath, PathPoint
from osimlite.simulation.elements import force_elements
from osimlite.simulation.system import System


def compute_isometric_tension(force: Any, lengths: Array, activations: Sequence[float]) -> Array:
    """Compute the tension of a force along a path at rest.

    The force is put between ground and a block on a slider that stands still.

    Args:
        force: muscle or other force along a path.
        lengths: lengths of the path (L,) (m).
        activations: activations (A,), on which only muscles depend.

    Returns:
        Tensions (A, L) (N); NaN where a muscle has no equilibrium.
    """
    model = Model(name="bench", gravity=(0.0, 0.0, 0.0))
    # In this test setup the length of the path is the position of the block.
    block = model.add(Body(name="block", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    model.add(SliderJoint(name="slide").between(model.ground, block))
    path = GeometryPath(name="path")
    for name, frame in (("a", "/ground"), ("b", "/bodyset/block")):
        path.path_point_set.objects.append(PathPoint(name=name, socket_parent_frame=frame))
    # The name of the force remains, because messages contain it.
    copy = force.copy_deep().model_copy(update={"geometry_path": path})
    model.add(copy)
    if isinstance(force, Muscle):
        # The control equals the time, because it is the activation of muscles without such a state.
        controller = PrescribedController(name="brain", socket_actuators=(copy,))
        controller.ControlFunctions.objects.append(LinearFunction(coefficients=(1.0, 0.0)))
        model.add(controller)
    mechanism = build_mechanism(model)
    system = System(mechanism, force_elements(model, mechanism))
    result = np.full((len(activations), len(lengths)), np.nan)
    for row, activation in zip(result, activations, strict=True):
        start = [
            # Fiber lengths are solved for; 0.1 m is a start.
            activation if variable.path.endswith("/activation") else 0.1
            for variable in system.state.variables
        ]
        for index, length in enumerate(lengths.tolist()):
            with suppress(SimulationError):
                state = system.equilibrate_muscles(activation, [length, 0.0, *start])
                row[index] = system.force_records(activation, state)[0]
    return result


def compute_mujoco_active_force(lengths: Array, lmin: float, lmax: float) -> Array:
    """Return the normalized active force of MuJoCo's muscles over the length of their fibers.

    It consists of four parabolas: it rises from 0 at `lmin` to 1 at the normalized length 1, and
    falls to 0 at `lmax` (MuJoCo's `mju_muscleGainLength`).

    Args:
        lengths: normalized lengths (L,).
        lmin: normalized length below which there is no force.
        lmax: normalized length above which there is no force.
    """
    rising_mid, falling_mid = 0.5 * (lmin + 1.0), 0.5 * (1.0 + lmax)
    is_short = lengths <= 1.0
    # Widths of 0 give NaN only where another branch is selected.
    with np.errstate(divide="ignore", invalid="ignore"):
        inner_distance = np.where(
            is_short, (1.0 - lengths) / (1.0 - rising_mid), (lengths - 1.0) / (falling_mid - 1.0)
        )
        outer_distance = np.where(
            is_short,
            (lengths - lmin) / (rising_mid - lmin),
            (lmax - lengths) / (lmax - falling_mid),
        )
    force = np.where(
        (lengths < rising_mid) | (lengths > falling_mid),
        0.5 * outer_distance**2,
        1.0 - 0.5 * inner_distance**2,
    )
    return np.where((lengths < lmin) | (lengths > lmax), 0.0, force)
