"""Points of links, and what pushes and turns them; a negative number of a link is ground."""

from __future__ import annotations

from osimlite.simulation.kernels.layout import (
    ACCELERATION,
    GRAVITY_AT,
    LINK_WORK,
    ORIGIN,
    POSITION,
    VELOCITY,
    WORK_LINK,
    WRENCH,
)
from osimlite.simulation.kernels.pointers import Floats, Ints, at


def station(s: Ints, w: Floats, link: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Position in ground of a point of a link."""
    if link < 0:
        return x, y, z
    r = at(w, s[WORK_LINK] + LINK_WORK * link)
    return (
        r[POSITION] + r[0] * x + r[1] * y + r[2] * z,
        r[POSITION + 1] + r[3] * x + r[4] * y + r[5] * z,
        r[POSITION + 2] + r[6] * x + r[7] * y + r[8] * z,
    )


def direction(s: Ints, w: Floats, link: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """A direction of a link, in ground."""
    if link < 0:
        return x, y, z
    r = at(w, s[WORK_LINK] + LINK_WORK * link)
    return r[0] * x + r[1] * y + r[2] * z, r[3] * x + r[4] * y + r[5] * z, r[6] * x + r[7] * y + r[8] * z


def velocity(s: Ints, w: Floats, link: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Velocity of the point of a link that is at (x, y, z) in ground."""
    if link < 0:
        return 0.0, 0.0, 0.0
    here = at(w, s[WORK_LINK] + LINK_WORK * link)
    v, px, py, pz = at(here, VELOCITY), x - here[ORIGIN], y - here[ORIGIN + 1], z - here[ORIGIN + 2]
    return v[3] + v[1] * pz - v[2] * py, v[4] + v[2] * px - v[0] * pz, v[5] + v[0] * py - v[1] * px


def angular_velocity(s: Ints, w: Floats, link: int) -> tuple[float, float, float]:
    """Angular velocity of a link."""
    if link < 0:
        return 0.0, 0.0, 0.0
    v = at(w, s[WORK_LINK] + LINK_WORK * link + VELOCITY)
    return v[0], v[1], v[2]


def acceleration(
    s: Ints, x: Floats, w: Floats, link: int, px: float, py: float, pz: float
) -> tuple[float, float, float]:
    """Acceleration of the point of a link that is at (px, py, pz) in ground, while the speeds do not change."""
    if link < 0:
        return 0.0, 0.0, 0.0
    here = at(w, s[WORK_LINK] + LINK_WORK * link)
    v, a, g = at(here, VELOCITY), at(here, ACCELERATION), at(x, GRAVITY_AT)
    px, py, pz = px - here[ORIGIN], py - here[ORIGIN + 1], pz - here[ORIGIN + 2]
    wx, wy, wz = v[0], v[1], v[2]
    vx, vy, vz = v[3] + wy * pz - wz * py, v[4] + wz * px - wx * pz, v[5] + wx * py - wy * px
    # Links are pushed upwards against gravity.
    return (
        a[3] + g[0] + a[1] * pz - a[2] * py + wy * vz - wz * vy,
        a[4] + g[1] + a[2] * px - a[0] * pz + wz * vx - wx * vz,
        a[5] + g[2] + a[0] * py - a[1] * px + wx * vy - wy * vx,
    )


def angular_acceleration_bias(s: Ints, w: Floats, link: int) -> tuple[float, float, float]:
    """Angular acceleration of a link while the speeds do not change."""
    if link < 0:
        return 0.0, 0.0, 0.0
    a = at(w, s[WORK_LINK] + LINK_WORK * link + ACCELERATION)
    return a[0], a[1], a[2]


def apply_force(s: Ints, w: Floats, link: int, x: float, y: float, z: float, fx: float, fy: float, fz: float) -> None:
    """Apply a force at a point of ground to a link."""
    if link < 0:
        return
    here = at(w, s[WORK_LINK] + LINK_WORK * link)
    load, px, py, pz = at(here, WRENCH), x - here[ORIGIN], y - here[ORIGIN + 1], z - here[ORIGIN + 2]
    load[0] += py * fz - pz * fy
    load[1] += pz * fx - px * fz
    load[2] += px * fy - py * fx
    load[3] += fx
    load[4] += fy
    load[5] += fz


def apply_torque(s: Ints, w: Floats, link: int, tx: float, ty: float, tz: float) -> None:
    """Apply a torque to a link."""
    if link < 0:
        return
    load = at(w, s[WORK_LINK] + LINK_WORK * link + WRENCH)
    load[0] += tx
    load[1] += ty
    load[2] += tz
