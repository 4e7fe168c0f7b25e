"""Interface of a motion for the views: contact forces, activations, interpolated columns."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.view.scene import Bodies, Color, Scene


class DrawableMotion(Protocol):
    """Recorded motion at n times, for example a Trajectory."""

    @property
    def times(self) -> Array:
        """Times (n,), s."""

    @property
    def coordinates(self) -> Sequence[str]:
        """Names of the k coordinates, in the order of the columns of `values` and `speeds`."""

    @property
    def values(self) -> Array:
        """Coordinate values (n, k), rad or m."""

    @property
    def speeds(self) -> Array:
        """Generalized speeds (n, k)."""

    @property
    def forces(self) -> Mapping[str, Array]:
        """Columns (n,) by OpenSim's labels, as ``RFootForce.RightShank.force.X``; in SI units."""

    @property
    def auxiliary(self) -> Mapping[str, Array]:
        """Other states (n,) by their paths, as ``/forceset/soleus_r/activation``."""


class ContactForce(NamedTuple):
    """Force (n, 3) in ground of the force element `element` on the frame `frame`, N.

    `torques` (n, 3), N·m, are about the origin of the frame's body; None if they are not recorded.
    """

    element: str
    frame: str
    vectors: Array
    torques: Array | None = None


def contact_forces(motion: DrawableMotion) -> list[ContactForce]:
    """Return the force vectors among the columns of `motion.forces`, in their order."""
    result = []
    for label in motion.forces:
        if label.endswith(".force.X"):
            prefix = label.removesuffix(".force.X")
            element, _, frame = prefix.partition(".")
            torques = (
                _find_columns(motion, f"{prefix}.torque")
                if f"{prefix}.torque.X" in motion.forces
                else None
            )
            result.append(
                ContactForce(element, frame, _find_columns(motion, f"{prefix}.force"), torques)
            )
    return result


def _find_columns(motion: DrawableMotion, label: str) -> Array:
    return np.column_stack(
        [np.asarray(motion.forces[f"{label}.{axis}"], dtype=float) for axis in "XYZ"]
    )


def read_activations(scene: Scene, motion: DrawableMotion) -> dict[str, Array]:
    """Read the recorded activations of muscles from the columns of a motion.

    Files of OpenSim 3 have them as ``soleus_r.activation``.

    Returns:
        Activations (n,), from 0 to 1, by component path; muscles without a column are missing.
    """
    activations = {}
    for label, column in motion.auxiliary.items():
        if result := re.fullmatch(r"(?:.*/)?(.+)[./]activation", label):
            # Unknown activations count as 0; rounding may leave the range.
            activations[result[1]] = np.clip(
                np.nan_to_num(np.asarray(column, dtype=float)), 0.0, 1.0
            )
    paths = [line.path for line in scene.lines if line.layer == "paths"]
    return {
        path: activations[name]
        for path in paths
        if (name := path.rpartition("/")[2]) in activations
    }


def activity_color(activation: float) -> Color:
    """Return the colour of a muscle at an activation of 0 (blue) to 1 (red), as in OpenSim."""
    return activation, 0.0, 1.0 - activation


def find_moving_bodies(poses: Sequence[Bodies]) -> Array:
    """Return a mask (b + 1,) of the bodies that move between poses; all but ground if none does."""
    rotations = np.array([p.rotations for p in poses])
    origins = np.array([p.origins for p in poses])
    # Rotations and origins that change by rounding do not count.
    changes = np.ptp(rotations, axis=0).max(axis=(1, 2)) + np.ptp(origins, axis=0).max(axis=1)
    result: Array = changes > 1e-9
    if not result.any():
        result[:-1] = True
    return result


def interpolate_columns(motion: DrawableMotion, columns: Array, times: Array) -> Array:
    """Interpolate columns (n, k) of the motion linearly at other times (m,).

    Returns:
        Columns at these times (m, k).
    """
    recorded = np.asarray(motion.times, dtype=float)
    rows = [np.interp(times, recorded, columns[:, k]) for k in range(columns.shape[1])]
    return np.array(rows).reshape(len(rows), len(times)).T


def get_values(motion: DrawableMotion, mechanism: Mechanism) -> Array:
    """Return the coordinate values (n, c) of the motion in the order of the mechanism's coordinates."""
    return order_columns(motion, mechanism, np.asarray(motion.values, dtype=float))


def order_columns(motion: DrawableMotion, mechanism: Mechanism, columns: Array) -> Array:
    """Return columns (n, k) of the motion in the order of the mechanism's coordinates (n, c), defaults elsewhere."""
    result = np.tile(mechanism.default_state()[0], (len(columns), 1))
    for k, name in enumerate(motion.coordinates):
        result[:, mechanism.coordinate_index(name)] = columns[:, k]
    return result
