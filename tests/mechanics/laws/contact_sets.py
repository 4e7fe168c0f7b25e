"""Reference for several contacts of one HuntCrossleyForce, surface by surface, with which kernels are compared."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import inf

from osimlite.mechanics.laws.hunt_crossley import contact_energy, contact_force

Contact = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float
]
"""Contact as d, R, k, c, us, ud, uv, n (3) and v (3): the arguments of `contact_force` except vt."""


def contact_forces(
    contacts: Iterable[Contact], vt: float, simbody_early_return: bool = False
) -> tuple[list[tuple[float, float, float]], float]:
    """Compute the forces and the energy of all contacts of one HuntCrossleyForce.

    Contacts do not influence each other, unless Simbody's defect is reproduced. There, the first
    contact that separates too fast to push ends the computation of this HuntCrossleyForce: the
    contacts after it lose their force and their energy.

    Args:
        contacts: one tuple per contact, in the order of `simbody_pair_order`, which matters for the
            defect only.
        vt: transition velocity of the HuntCrossleyForce (m/s).
        simbody_early_return: reproduce the defect, for comparisons with OpenSim.

    Returns:
        Force on surface 2 (N) of each contact, in the same order, and the potential energy (J).
    """
    forces = []
    energy = 0.0
    ended = False
    for d, R, k, c, us, ud, uv, nx, ny, nz, vx, vy, vz in contacts:
        if ended:
            forces.append((0.0, 0.0, 0.0))
            continue
        energy += contact_energy(d, R, k)
        force = contact_force(d, R, k, c, us, ud, uv, vt, (nx, ny, nz), (vx, vy, vz))
        forces.append(force)
        ended = simbody_early_return and d > 0.0 and force == (0.0, 0.0, 0.0)
    return forces, energy


def simbody_pair_order(
    centres: Sequence[tuple[float, float, float]], radii: Sequence[float]
) -> list[tuple[int, int]]:
    """Return pairs of surfaces of one HuntCrossleyForce that may touch, in the order in which Simbody treats them.

    Simbody sweeps along the axis of ground on which the centres lie farthest apart (largest sum of
    distances from their mean), starting from the surface that begins first, and drops pairs whose
    bounding spheres are apart. Pairs on the same body are included: their force has no effect, but
    OpenSim counts their energy.

    Args:
        centres: centre of each surface in ground (m), in the order of the file; the origin of its
            frame for a half space.
        radii: radius of each sphere (m); `inf` for a half space.

    Returns:
        Pairs (surface 1, surface 2) of indices. A half space is always surface 1, and two half
        spaces make no pair.
    """
    n = len(centres)
    spread = []
    for axis in range(3):
        mean = sum(centre[axis] for centre in centres) / max(n, 1)
        spread.append(sum(abs(centre[axis] - mean) for centre in centres))
    axis = 0 if spread[0] > spread[1] else 1
    if spread[2] > spread[axis]:
        axis = 2
    start = [centres[i][axis] - radii[i] for i in range(n)]
    order = sorted(range(n), key=start.__getitem__)
    pairs = []
    for position, i in enumerate(order):
        for j in order[position + 1 :]:
            if start[j] > centres[i][axis] + radii[i]:
                break
            if radii[i] == inf and radii[j] == inf:
                continue
            reach = radii[i] + radii[j]
            apart = sum((p - q) * (p - q) for p, q in zip(centres[i], centres[j], strict=True))
            if apart <= reach * reach:
                pairs.append((j, i) if radii[j] == inf else (i, j))
    return pairs
