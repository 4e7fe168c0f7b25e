"""Several contacts of one HuntCrossleyForce, surface by surface: what the kernels are compared with."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import inf

from osimlite.mechanics.laws.hunt_crossley import contact_energy, contact_force

Contact = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float
]
"""d, R, k, c, us, ud, uv, and the numbers of n and v: the arguments of `contact_force` but for vt."""


def contact_forces(
    contacts: Iterable[Contact], vt: float, simbody_early_return: bool = False
) -> tuple[list[tuple[float, float, float]], float]:
    """All contacts of one HuntCrossleyForce: the force on surface 2 of each, and their potential energy.

    Each contact is on its own, unless Simbody's defect is asked for: there the first contact that
    separates too fast to push ends the work on this HuntCrossleyForce, and the contacts after it
    lose their force and their energy.

    Args: contacts: one tuple per contact, in the order of `simbody_pair_order` (the order matters
        to the defect only). vt: transition velocity of the HuntCrossleyForce, m/s.
        simbody_early_return: reproduce the defect, to compare with OpenSim.

    Returns:
        One (fx, fy, fz) in N for each contact, in the same order, and the energy in J.
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
    """Pairs of surfaces of one HuntCrossleyForce that may touch, in the order in which Simbody works on them.

    Simbody sweeps along the axis of ground on which the centres lie farthest apart (largest sum of
    distances from their mean), starting from the surface that begins first, and drops pairs whose
    bounding spheres are apart. Pairs on the same body are among them: their force has no effect,
    but OpenSim counts their energy.

    Args: centres: centre of each surface in ground, m, in the order in which the file lists them;
        of a half space the origin of its frame. radii: radius of each sphere, m; `inf` marks a half
        space.

    Returns: Pairs (surface 1, surface 2) of indices; a half space is always surface 1. Two half
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
