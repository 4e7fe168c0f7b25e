"""Geometry of a bushing between two frames."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import (
    angular_velocity,
    apply_force,
    apply_torque,
    direction,
    station,
    velocity,
)
from osimlite.mechanics.laws.bushing import xyz_angles, xyz_moment, xyz_rates
from osimlite.mechanics.laws.vectors import minus, rotate, rotate_back, store_vector, times, vector
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.geometries.geometry import ForceGeometry

# Offsets in the record. Force and moment on the second frame (0 to 5) and the origins of both frames
# (6 to 11) come first.
DEVIATIONS = 12
"""Offset of the six deviations: angles (rad), then translation (m)."""
LOADS = 18
"""Offset of the six loads: moments (N.m), then forces (N)."""
RATES = 24
"""Offset of the rates of the deviations, 1/s and m/s."""
AXES = 30
"""Offset of the axes of both frames in ground."""
RECORD_SIZE = 48
"""Size of the record of a bushing."""


def compute_deviations(model: Ints, data: Floats, g: Ints, gp: Floats, work: Floats) -> None:
    """Compute the deviations of the second frame from the first, and their rates, into the record.

    The angles are body-fixed X-Y-Z angles of the second frame in the first.

    Args:
        model: integers of the model.
        data: work vector.
        g: links of both frames.
        gp: axes (9,) and origin (3,) of each frame in its link.
        work: record of the bushing.
    """
    d, rates = at(work, DEVIATIONS), at(work, RATES)
    for k in range(3):
        store_vector(work, AXES + 3 * k, direction(model, data, g[0], vector(gp, 3 * k)))
        store_vector(work, AXES + 9 + 3 * k, direction(model, data, g[1], vector(gp, 12 + 3 * k)))
    one = at(work, AXES)
    two = at(work, AXES + 9)
    start = station(model, data, g[0], vector(gp, 9))
    end = station(model, data, g[1], vector(gp, 21))
    store_vector(work, 6, start)
    store_vector(work, 9, end)
    x, y, z = rotate(one, vector(two, 0)), rotate(one, vector(two, 3)), rotate(one, vector(two, 6))
    store_vector(d, 0, xyz_angles(x[0], y[0], z[0], x[1], y[1], z[1], z[2]))
    # The translation is that of the origins, along the axes of the first frame.
    store_vector(d, 3, rotate(one, minus(end, start)))
    # The rate is that in the first frame, which itself rotates.
    store_vector(
        rates,
        3,
        rotate(one, minus(velocity(model, data, g[1], end), velocity(model, data, g[0], end))),
    )
    # The angular velocity of the second frame relative to the first, in its own axes.
    wx, wy, wz = rotate(
        two, minus(angular_velocity(model, data, g[1]), angular_velocity(model, data, g[0]))
    )
    store_vector(rates, 0, xyz_rates(d[1], d[2], wx, wy, wz))


def load_frames(model: Ints, data: Floats, g: Ints, work: Floats) -> None:
    """Apply the loads to both bodies; the record then has force and moment on the second frame.

    Args:
        model: integers of the model.
        data: work vector.
        g: links of both frames.
        work: record of the bushing.
    """
    loads, d = at(work, LOADS), at(work, DEVIATIONS)
    # The loads of the law are generalized: forces along the axes of the first frame, moments about
    # the angles.
    force = rotate_back(at(work, AXES), vector(loads, 3))
    moment = rotate_back(at(work, AXES + 9), xyz_moment(d[1], d[2], loads[0], loads[1], loads[2]))
    store_vector(work, 0, force)
    store_vector(work, 3, moment)
    apply_force(model, data, g[1], vector(work, 9), force)
    apply_force(model, data, g[0], vector(work, 9), times(-1.0, force))
    apply_torque(model, data, g[1], moment)
    apply_torque(model, data, g[0], times(-1.0, moment))


def mask_undamped_rate(rate: float, damping: float) -> float:
    """Return the rate, or 0 without damping, because rates of angles may be infinite.

    Args:
        rate: rate of a deviation, rad/s or m/s.
        damping: damping of this deviation, N.m.s/rad or N.s/m.
    """
    return rate if damping != 0.0 else 0.0


def add_damping(loads: Floats, rates: Floats, damping: Floats) -> None:
    """Replace resisting loads by applied loads with damping: load = -load - damping * rate.

    Args:
        loads: loads of the law (6,), which are replaced.
        rates: rates of the deviations (6,).
        damping: damping of each deviation (6,).
    """
    for k in range(6):
        loads[k] = -loads[k] - damping[k] * mask_undamped_rate(rates[k], damping[k])


class Frame(NamedTuple):
    """Frame of a bushing.

    Attributes:
        name: name of the frame.
        body: index of the body that the frame is fixed to.
        frame_in_body: transform of the frame in this body (4, 4).
    """

    name: str
    body: int
    frame_in_body: Array


@dataclass(frozen=True)
class BetweenFrames(ForceGeometry):
    """Two frames, with the deviations of the second from the first as inputs of the law.

    The deviations are three angles (rad) and a translation (m). The law fills `loads`: moments
    (N.m) of the angles and forces (N) of the translation on the second frame.

    Attributes:
        about_bodies: whether reported torques are about the origins of the bodies instead of the
            frames.
    """

    about_bodies: bool = False

    inputs = ("deviations", "rates", "loads")
    setup_code = (
        "compute_deviations(model, data, g, gp, work)",
        f"deviations, rates, loads = at(work, {DEVIATIONS}), at(work, {RATES}), at(work, {LOADS})",
    )
    apply_code = ("load_frames(model, data, g, work)",)
    called_functions = (compute_deviations, load_frames)

    def read(self, builder: ElementBuilder, force: Any) -> tuple[Frame, ...]:
        """Return the two frames.

        Returns:
            The first and the second frame.
        """
        frames = []
        for field in ("socket_frame1", "socket_frame2"):
            frame = builder.resolve_target(force, field, getattr(force, field))
            frames.append(Frame(frame.name, *builder.find_placement(frame)))
        return tuple(frames)

    def pack(
        self, location: tuple[Frame, ...], link_map: LinkMap
    ) -> tuple[Sequence[int], Sequence[float]]:
        """Return the links of the frames, and axes and origin of each frame in its link.

        Returns:
            Integers and numbers of the geometry.
        """
        (one, first), (two, second) = (
            link_map.frame(frame.body, frame.frame_in_body) for frame in location
        )
        return (one, two), (*first, *second)

    def record_size(self, location: Any) -> int:
        """Return the size of its part of the record."""
        return RECORD_SIZE

    def list_columns(self, force: Any) -> tuple[str, ...]:
        """Return the labels of force and torque on each of the frames.

        Returns:
            Labels of the columns.
        """
        labels = [f"{kind}.{axis}" for kind in ("force", "torque") for axis in "XYZ"]
        return tuple(
            f"{force.name}.{frame.name}.{label}" for frame in force.location for label in labels
        )

    def report(
        self, force: Any, record: Sequence[float], origins: Sequence[Sequence[float]]
    ) -> list[float]:
        """Return the loads on both frames.

        Args:
            force: the element.
            record: record of the bushing.
            origins: origin of each body in ground, m; ground's origin is the last.

        Returns:
            Force (N) and torque (N.m) on the first and on the second frame in ground, about the
            origins of the frames or of their bodies.
        """
        # The record has the load on the second frame.
        load, moment, start, end = np.array(record[:12], dtype=float).reshape(4, 3)
        first, second = start, end
        if self.about_bodies:
            first, second = (np.array(origins[frame.body]) for frame in force.location)
        # Both forces act at the origin of the second frame.
        row: list[Array] = [
            -load,
            -moment - np.cross(end - first, load),
            load,
            moment + np.cross(end - second, load),
        ]
        return [float(number) for part in row for number in part]
