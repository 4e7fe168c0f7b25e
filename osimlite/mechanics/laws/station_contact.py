"""Contact of a point with the plane y = 0 of ground, by a damped spring that sets in smoothly.

Source: A. J. Meyer et al., "Muscle synergies facilitate computational prediction of
subject-specific walking motions", Frontiers in Bioengineering and Biotechnology 4 (2016) 77, in the
form of OpenSim's MeyerFregly2016Force.
"""

from __future__ import annotations

from math import cosh, log, sqrt, tanh


def station_contact_force(
    y: float,
    vx: float,
    vy: float,
    vz: float,
    k: float,
    c: float,
    l0: float,
    ud: float,
    uv: float,
    vl: float,
) -> tuple[float, float, float]:
    """Force on the point.

    With h = 0.7 tanh((y - l0) / 0.7), s = (k - k0) / 2 and v = (k + k0) / (k - k0), the elastic
    force is s (v (y0 - h) - e (log cosh((y0 + d) / e) - log cosh((h + d) / e))); k0 = 0.1 N/m, y0 =
    0.01 m, d = e = 0.001 m. It is multiplied by 1 - c vy, and rubs with (ud tanh(w / vl) + uv w)
    times its size, w being the slip.

    Args:
        y: height of the point, m.
        vx: velocity (vx, vy, vz) of the point in ground, m/s.
        k: stiffness, N/m, not k0.
        c: dissipation, s/m.
        l0: height at which the spring rests, m.
        ud: coefficient of dynamic friction, 1.
        uv: coefficient of viscous friction, s/m.
        vl: latch velocity, m/s, not 0.

    Returns:
        (fx, fy, fz), N.
    """
    h = 0.7 * tanh((y - l0) / 0.7)
    s = 0.5 * (k - 0.1)
    v = (k + 0.1) / (k - 0.1)
    elastic = s * (v * (0.01 - h) - 0.001 * (log(cosh(11.0)) - log(cosh((h + 0.001) / 0.001))))
    fy = elastic * (1.0 - c * vy)
    w = sqrt(vx * vx + vz * vz)
    g = -fy * (ud * tanh(w / vl) + uv * w) / (w + 1e-4)
    return g * vx, fy, g * vz
