"""Springs on a coordinate, between two points and along a path.

q is a coordinate and u its speed; l is a length and v its rate of change. Tensions are positive
where they pull.
Sources: Hooke's law; for a path, R. Hunt and F. Crossley's form of dissipation (proportional to the
elastic force) as OpenSim's PathSpring has it; for ligaments L. Blankevoort and R. Huiskes,
"Ligament-bone interaction in a three-dimensional model of the knee", Journal of Biomechanical
Engineering 113 (1991) 263-269.
"""

from __future__ import annotations

from math import pi


def coordinate_spring_force(q: float, u: float, k: float, q0: float, c: float) -> float:
    """Return the generalized force -k (q - q0) - c u, in N m (N for a translation).

    Args:
        q: coordinate, rad (m).
        u: speed of the coordinate, rad/s (m/s).
        k: stiffness, N m/rad (N/m).
        q0: rest value of the coordinate, rad (m).
        c: viscosity, N m/(rad/s) (N/(m/s)).
    """
    return -k * (q - q0) - c * u


def spring_energy(x: float, k: float) -> float:
    """Return the energy k x^2 / 2 of a linear spring (J).

    Args:
        x: deviation from rest, rad (m).
        k: stiffness, N m/rad (N/m).
    """
    return 0.5 * k * x * x


def point_spring_tension(length: float, k: float, l0: float) -> float:
    """Return the tension k (l - l0) of a spring that pulls and pushes (N).

    Args:
        length: length l (m).
        k: stiffness (N/m).
        l0: rest length (m).
    """
    return k * (length - l0)


def path_spring_tension(length: float, rate: float, l0: float, k: float, d: float) -> float:
    """Return the tension k (l - l0) (1 + d v) of a spring along a path where l > l0, else 0 (N).

    It pushes where the path shortens faster than 1/d, as in OpenSim.

    Args:
        length: length l (m).
        rate: lengthening speed v (m/s).
        l0: rest length (m).
        k: stiffness (N/m).
        d: dissipation (s/m).
    """
    return k * (length - l0) * (1.0 + d * rate) if length > l0 else 0.0


def path_spring_energy(length: float, l0: float, k: float) -> float:
    """Return the energy k (l - l0)^2 / 2 of a spring along a path where l > l0, else 0 (J).

    Args:
        length: length l (m).
        l0: rest length (m).
        k: stiffness (N/m).
    """
    return 0.5 * k * (length - l0) * (length - l0) if length > l0 else 0.0


def path_stretch(length: float, l0: float, clamped: bool) -> float:
    """Return l - l0, not less than 0 if `clamped` (m).

    Args:
        length: length l (m).
        l0: rest length (m).
        clamped: whether a slack path has no stretch.
    """
    return 0.0 if clamped and length < l0 else length - l0


def blankevoort_tension(
    length: float, rate: float, l0: float, k: float, e1: float, c: float
) -> float:
    """Return the tension of a ligament at the strain e = l / l0 - 1 (N).

    It is k e^2 / (2 e1) for 0 < e < e1, and k (e - e1 / 2) beyond. While the ligament is taut and
    lengthens, c v / l0 is added, which sets in along 10 x^3 - 15 x^4 + 6 x^5 with x = e / 0.01, as in
    OpenSim.

    Args:
        length: length l (m).
        rate: lengthening speed v (m/s).
        l0: slack length (m).
        k: stiffness of the linear region (N per strain).
        e1: strain at which the linear region begins.
        c: damping (N s per strain rate).
    """
    e = length / l0 - 1.0
    if e <= 0.0:
        return 0.0
    tension = 0.5 * k / e1 * e * e if e < e1 else k * (e - 0.5 * e1)
    # OpenSim damps only lengthening ligaments, and lets damping set in over 1 % of strain.
    if rate > 0.0:
        x = e / 0.01 if e < 0.01 else 1.0
        tension += x * x * x * (10.0 + x * (6.0 * x - 15.0)) * c * rate / l0
    return tension


def blankevoort_energy(length: float, l0: float, k: float, e1: float) -> float:
    """Return the energy of a ligament (J).

    It is the integral of the elastic tension over the length: k l0 e^3 / (6 e1) for 0 < e < e1, and k
    l0 (e (e - e1) / 2 + e1^2 / 6) beyond.

    Args:
        length: length l (m).
        l0: slack length (m).
        k: stiffness of the linear region (N per strain).
        e1: strain at which the linear region begins.
    """
    e = length / l0 - 1.0
    if e <= 0.0:
        return 0.0
    if e < e1:
        return k * l0 * e * e * e / (6.0 * e1)
    return k * l0 * (0.5 * e * (e - e1) + e1 * e1 / 6.0)


def mckibben_tension(L: float, p: float, n: float, B: float, l0: float) -> float:
    """Return the tension p (3 (L - l0)^2 - B^2) / (4 pi n^2) of a pneumatic muscle (N).

    Source: C.-P. Chou and B. Hannaford, "Measurement and modeling of McKibben pneumatic artificial
    muscles", IEEE Transactions on Robotics and Automation 12 (1996) 90-102.

    Args:
        L: length of the path (m).
        p: pressure (Pa).
        n: number of turns of the thread.
        B: length of the thread (m).
        l0: length of the cord in the path (m).
    """
    length = L - l0
    return p * (3.0 * length * length - B * B) / (4.0 * pi * n * n)
