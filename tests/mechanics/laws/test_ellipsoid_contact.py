from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from osimlite.mechanics.laws.ellipsoid_contact import ellipsoid_ellipsoid, half_space_ellipsoid
from osimlite.mechanics.laws.hunt_crossley import half_space_sphere, sphere_sphere
from osimlite.mechanics.laws.vectors import ZERO

NUMBERS = st.floats(-1.0, 1.0)
TRIPLES = st.tuples(NUMBERS, NUMBERS, NUMBERS)


def turned(seed):
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


@given(TRIPLES, TRIPLES, st.integers(0, 99), st.floats(0.1, 1.0), st.floats(0.0, 1.0))
def test_three_equal_axes_make_a_sphere(plane, center, seed, r, a):
    normal = turned(seed + 100)[0]
    d, R, point = half_space_ellipsoid(plane, normal, center, turned(seed).T, (r, r, r), a)
    depth, where = half_space_sphere(plane, normal, center, r, a)
    assert d == pytest.approx(depth, abs=1e-12)
    if depth > 1e-9:
        assert pytest.approx(r) == R and point == pytest.approx(where, abs=1e-12)


@given(st.integers(0, 99), st.tuples(*[st.floats(0.2, 2.0)] * 3))
def test_depth_and_point_against_a_search(seed, radii):
    """If the half space takes all of the deformation, the contact point is the deepest point of the ellipsoid."""
    axes, normal = turned(seed), turned(seed + 100)[0]
    place = 1.0, 2.0, 3.0
    d, _, point = half_space_ellipsoid(place, normal, place, axes.T, radii, 1.0)
    directions = np.random.default_rng(1).normal(size=(4000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    heights = directions * radii @ axes.T @ normal
    assert heights.min() == pytest.approx(-d, rel=0.02)
    own = axes.T @ (np.array(point) - (1.0, 2.0, 3.0)) / radii
    assert own @ own == pytest.approx(1.0)
    assert (np.array(point) - (1.0, 2.0, 3.0)) @ normal == pytest.approx(-d)


IDENTITY = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
POSITIVE = st.floats(0.2, 2.0)


@given(POSITIVE, POSITIVE, *[st.floats(-1.0, 1.0)] * 3, st.floats(0.0, 1.0))
def test_two_round_ellipsoids_are_spheres(r1, r2, x, y, z, a):
    # Squares of smaller numbers underflow.
    assume(max(map(abs, (x, y, z))) > 1e-140)
    sphere = sphere_sphere(ZERO, r1, (x, y, z), r2, a)
    result = ellipsoid_ellipsoid(ZERO, IDENTITY, (r1, r1, r1), (x, y, z), IDENTITY, (r2, r2, r2), a)
    if sphere[0] > 1e-9:
        for one, other in zip(result, sphere, strict=True):
            assert one == pytest.approx(other, rel=1e-9, abs=1e-12)
    elif sphere[0] < -1e-9:
        assert result[0] < 0.0


def test_ellipsoids_end_to_end():
    """Half axes are 2, 1, 1 and 1, 3, 1, and the X axes are aligned: curvatures there are 2, 2 and 1/9, 1."""
    d, R, n, point = ellipsoid_ellipsoid(
        ZERO, IDENTITY, (2.0, 1.0, 1.0), (2.9, 0.0, 0.0), IDENTITY, (1.0, 3.0, 1.0), 0.25
    )
    assert (d, R) == (pytest.approx(0.1), pytest.approx(((2.0 + 1.0 / 9.0) * (2.0 + 1.0)) ** -0.5))
    assert (*n, *point) == pytest.approx([1.0, 0.0, 0.0, 1.975, 0.0, 0.0])
