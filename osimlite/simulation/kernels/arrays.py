"""What the kernels work on.

A mechanism is a tree of links. A link is one body, or several that never move in one another, and has its frame where
the last motion of its joint ends. The way from the carrying link to it is a list of operations: each is a fixed
transform and then one motion, along or about the z axis if it has an axis. The degrees of freedom are numbered in the
order of the links, so that what carries stands before what is carried.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TURN, SLIDE, BALL, BALL_BACK = 0, 1, 2, 3
"""Motions of an operation: about z, along z, a SphericalMotion, and one that is passed from its end to its start."""

NOTHING, SHIFT, MOVE = 0, 1, 2
"""Fixed transform of an operation: none, a translation, any."""

HALF_SPACE, SPHERES = 0, 1
"""Kinds of contact pairs."""


class Structure(NamedTuple):
    """L links, K operations, n degrees of freedom, F functions, P contact pairs, m limits.

    Attributes:
        parent: of each link, -1 for ground (L,).
        operations: first operation of each link, and K (L + 1,).
        freedoms: first degree of freedom of each link, and n (L + 1,).
        kind: of each operation (K,).
        before: kind of its fixed transform (K,).
        function: that gives its amount, -1 if the first argument is the amount (K,).
        first_argument: of each operation, and the number of all arguments (K + 1,).
        arguments: degrees of freedom; -1 for a number that does not change.
        above: of each degree of freedom the next one on the way to ground, -1 if there is none (n,).
        function_kind: see :mod:`osimlite.simulation.kernels.functions` (F,).
        function_start: where its numbers begin, and the length of the table (F + 1,).
        pair_kind: (P,).
        pair_links: link of either surface, -1 for ground (P, 2).
        limited: degree of freedom of each limit (m,).
    """

    parent: Ints
    operations: Ints
    freedoms: Ints
    kind: Ints
    before: Ints
    function: Ints
    first_argument: Ints
    arguments: Ints
    above: Ints
    function_kind: Ints
    function_start: Ints
    pair_kind: Ints
    pair_links: Ints
    limited: Ints


class Numbers(NamedTuple):
    """The numbers of a mechanism and its forces, in SI units.

    Attributes:
        gravity: in ground (3,).
        fixed: rotation by rows and translation of the fixed transforms (K, 12).
        radii: of the ellipsoid of a BALL (K, 3).
        inertia: mass, mass centre in the link, xx, yy, zz, xy, xz, yz about it along the link's axes (L, 10).
        constants: values of the arguments that do not change (as many as arguments).
        table: of the functions.
        pairs: centre, normal and radius of surface 1 in its link, centre and radius of surface 2, then k, a, c, us, ud,
            uv, vt of the law (P, 18).
        limits: Ku, qu, Kl, ql, D, t of the law (m, 6).
    """

    gravity: Floats
    fixed: Floats
    radii: Floats
    inertia: Floats
    constants: Floats
    table: Floats
    pairs: Floats
    limits: Floats


class Work(NamedTuple):
    """What an evaluation leaves behind. Spatial vectors stack the angular part over the linear part.

    Velocities, accelerations, inertias and wrenches are along the axes of ground and about `origin`, a point that
    stays in ground; it is taken near the links, so that no digits are lost far away from ground's origin.

    Attributes:
        rotation: of each link in ground, by rows (L, 9).
        position: of its origin (L, 3).
        axes: of each operation the axis, or the frame by rows that a BALL starts from (K, 9).
        point: where that is (K, 3).
        amount: of each operation (K,).
        origin: (3,).
        columns: what a unit of each speed moves the link by (n, 6).
        velocity: of each link (L, 6).
        acceleration: of each link while the derivatives of all speeds are zero, upwards against gravity (L, 6).
        inertia: of each link; of all that it carries too after the evaluation: mass, first moment, xx, yy, zz, xy,
            xz, yz (L, 10).
        wrench: likewise (L, 6).
        matrix: mass matrix below the diagonal, later its factors (n, n).
        pivots: diagonal of the mass matrix (n,).
        gradient: of a function (k,).
        contacts: of each pair the force on surface 2, its point, depth and radius of the law; all zero where there is
            no contact (P, 8).
    """

    rotation: Floats
    position: Floats
    axes: Floats
    point: Floats
    amount: Floats
    origin: Floats
    columns: Floats
    velocity: Floats
    acceleration: Floats
    inertia: Floats
    wrench: Floats
    matrix: Floats
    pivots: Floats
    gradient: Floats
    contacts: Floats


def numbers_of(structure: Structure, vector: Floats) -> Numbers:
    """The numbers as views of one vector."""
    links, operations, arguments = len(structure.parent), len(structure.kind), len(structure.arguments)
    pairs, limits = len(structure.pair_kind), len(structure.limited)
    a = 3 + 12 * operations
    b = a + 3 * operations
    c = b + 10 * links
    d = c + arguments
    e = d + structure.function_start[-1]
    f = e + 18 * pairs
    return Numbers(
        vector[:3],
        vector[3:a].reshape((operations, 12)),
        vector[a:b].reshape((operations, 3)),
        vector[b:c].reshape((links, 10)),
        vector[c:d],
        vector[d:e],
        vector[e:f].reshape((pairs, 18)),
        vector[f : f + 6 * limits].reshape((limits, 6)),
    )


def vector_of(numbers: Numbers) -> Floats:
    """One vector of all numbers, of which :func:`numbers_of` gives views."""
    parts: Any = [part.ravel() for part in numbers]
    return np.concatenate(parts).astype(np.float64)


def work_for(structure: Structure) -> Work:
    """Room for evaluations."""
    links, operations, size = len(structure.parent), len(structure.kind), len(structure.above)
    return Work(
        np.zeros((links, 9)),
        np.zeros((links, 3)),
        np.zeros((operations, 9)),
        np.zeros((operations, 3)),
        np.zeros(operations),
        np.zeros(3),
        np.zeros((size, 6)),
        np.zeros((links, 6)),
        np.zeros((links, 6)),
        np.zeros((links, 10)),
        np.zeros((links, 6)),
        np.zeros((size, size)),
        np.zeros(size),
        np.zeros(len(structure.arguments) + 1),
        np.zeros((len(structure.pair_kind), 8)),
    )
