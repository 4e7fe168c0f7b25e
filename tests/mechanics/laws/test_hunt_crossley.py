"""Tests of Hunt-Crossley contact against OpenSim's tables, and of properties that any such law must have."""

from __future__ import annotations

import csv
import gzip
import itertools
import json
import math
from math import inf, sqrt

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from osimlite.mechanics.laws.hunt_crossley import (
    combine_materials,
    contact_derivatives,
    contact_energy,
    contact_force,
    half_space_sphere,
    sphere_sphere,
)
from osimlite.mechanics.laws.vectors import ZERO
from tests.mechanics.laws.contact_sets import contact_forces, simbody_pair_order

# -------------------------------------------------------------------------------------------- OpenSim's table


def body_fixed_xyz(angles):
    """Return the rotation matrix Rx Ry Rz of three angles (rad)."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles), np.sin(angles)
    x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return x @ y @ z


def evaluate(row):
    """Evaluate the pose of a row of the table.

    Returns:
        Forces and moments about the body origins (F2, M2, F1, M1), and the energy.
    """

    def vector(prefix, names="xyz"):
        return np.array([row[prefix + name] for name in names])

    R1, R2 = body_fixed_xyz(vector("b1_r")), body_fixed_xyz(vector("b2_r"))
    p1, p2 = vector("b1_t"), vector("b2_t")
    centre1 = p1 + R1 @ vector("b1_loc")
    centre2 = p2 + R2 @ vector("b2_loc")
    materials = [row[name + side] for side in "12" for name in ("k", "c", "us", "ud", "uv")]
    k, a, c, us, ud, uv = combine_materials(*materials)
    if row["kind"] == "halfspace-sphere":
        n = R1 @ body_fixed_xyz(vector("b1_ori")) @ [-1.0, 0.0, 0.0]
        d, P = half_space_sphere(centre1, n, centre2, row["R2"], a)
        R = row["R2"]
    else:
        d, R, n, P = sphere_sphere(centre1, row["R1"], centre2, row["R2"], a)
    P = np.array(P)
    v1 = vector("b1_v") + np.cross(vector("b1_w"), P - p1)
    v2 = vector("b2_v") + np.cross(vector("b2_w"), P - p2)
    F = np.array(contact_force(d, R, k, c, us, ud, uv, row["vt"], n, v1 - v2))
    parts = F, np.cross(P - p2, F), -F, np.cross(P - p1, -F)
    return np.concatenate(parts), contact_energy(d, R, k)


@pytest.fixture(scope="module")
def table(fixtures):
    with gzip.open(fixtures / "forces" / "hunt_crossley_table.csv.gz", "rt") as text:
        rows = list(csv.DictReader(line for line in text if not line.startswith("#")))
    return [{n: v if n in ("case", "kind") else float(v) for n, v in row.items()} for row in rows]


def test_table_forces_and_energies(table):
    """Tolerances are relative: to the largest component of a force or moment, and to the energy."""
    assert len(table) == 2232
    touching = 0
    for row in table:
        result, energy = evaluate(row)
        names = [kind + axis for kind in ("F2", "M2", "F1", "M1") for axis in "xyz"]
        expected = np.array([row[name] for name in names])
        if row["PE"] == 0.0:
            assert energy == 0.0
            assert not result.any() and not expected.any()
            continue
        touching += 1
        assert energy == pytest.approx(row["PE"], rel=1e-9, abs=0.0)
        for vector in (slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)):
            scale = np.abs(expected[vector]).max()
            assert np.abs(result[vector] - expected[vector]).max() <= 1e-9 * scale
    assert touching > 1500


# ------------------------------------------------------------------- several spheres in one HuntCrossleyForce

RADIUS, DEPTH, UP = 0.05, 0.01, (0.0, 1.0, 0.0)
MATERIAL = 1e6, 1.0, 0.8, 0.4, 0.4


def plane_contacts(positions, separating, names):
    """Return contacts of spheres 1 cm deep in the plane y = 0; selected spheres separate at 1 m/s.

    Args:
        positions: x of each sphere (m).
        separating: whether each sphere separates.
        names: name of each sphere.

    Returns:
        Contacts and names of their spheres, both in Simbody's order.
    """
    k, a, c, us, ud, uv = combine_materials(*MATERIAL, *MATERIAL)
    centres = [(0.0, 0.0, 0.0), *((x, RADIUS - DEPTH, 0.0) for x in positions)]
    radii = [inf, *(RADIUS for _ in positions)]
    contacts, order = [], []
    for first, second in simbody_pair_order(centres, radii):
        if first != 0:
            assert sphere_sphere(centres[first], RADIUS, centres[second], RADIUS, a)[0] <= 0.0
            continue
        d, *_ = half_space_sphere(ZERO, UP, centres[second], RADIUS, a)
        vy = -1.0 if separating[second - 1] else 0.0
        contacts.append((d, RADIUS, k, c, us, ud, uv, 0.0, 1.0, 0.0, 0.0, vy, 0.0))
        order.append(names[second - 1])
    return contacts, order


TWO_SPHERES = list(itertools.product([(0, 0), (1, 0), (0, 1)], [(0, 1), (1, 0)]))


@pytest.fixture(scope="module")
def measured(fixtures):
    return json.loads((fixtures / "forces" / "hunt_crossley_multicontact.json").read_text())


@pytest.mark.parametrize(("separating", "positions"), TWO_SPHERES)
def test_two_spheres_as_simbody_does_it(measured, separating, positions):
    what = f"vA={separating[0]} vB={separating[1]}", f"xA={positions[0]} xB={positions[1]}"
    two_spheres = (x for x in measured if x["case"] == "one_force_two_spheres")
    (case,) = (x for x in two_spheres if all(w in x["desc"] for w in what))
    contacts, order = plane_contacts([float(x) for x in positions], separating, "AB")
    forces, energy = contact_forces(contacts, 0.2, simbody_early_return=True)
    for name, force in zip(order, forces, strict=True):
        expected = [
            case["values"][case["labels"].index(f"f.{name}.force.{axis}")] for axis in "XYZ"
        ]
        assert force == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert energy == pytest.approx(case["PE"], rel=1e-9)


@pytest.mark.parametrize(("separating", "positions"), TWO_SPHERES)
def test_two_spheres_each_on_its_own(measured, separating, positions):
    """By default each sphere has the force that it has alone (case vA=0 vB=0), whatever the other one does."""
    alone = next(x for x in measured if x["case"] == "one_force_two_spheres")
    contacts, order = plane_contacts([float(x) for x in positions], separating, "AB")
    forces, energy = contact_forces(contacts, 0.2)
    for name, force in zip(order, forces, strict=True):
        fy = 0.0 if separating["AB".index(name)] else alone["values"][1]
        assert force == pytest.approx((0.0, fy, 0.0), rel=1e-9, abs=1e-9)
    assert energy == pytest.approx(alone["PE"], rel=1e-9)


def measured_case(measured, name):
    (case,) = (x for x in measured if x["case"] == name)
    return case["values"], case["PE"]


def test_spheres_of_one_force_touch_each_other(measured):
    values, energy = measured_case(measured, "one_force_sphere_sphere_pair")
    k, a, c, us, ud, uv = combine_materials(*MATERIAL, *MATERIAL)
    assert simbody_pair_order([(0, 0, 0), (0, 1, 0), (0.09, 1, 0)], [inf, 0.05, 0.05])[-1] == (1, 2)
    d, R, n, _ = sphere_sphere(UP, 0.05, (0.09, 1.0, 0.0), 0.05, a)
    assert contact_energy(d, R, k) == pytest.approx(energy, rel=1e-9)
    force = contact_force(d, R, k, c, us, ud, uv, 0.2, n, ZERO)
    assert force == pytest.approx(values[6:9], rel=1e-9)


def test_no_friction_transition(measured):
    """With a transition velocity of 0, friction is dynamic and viscous at any slip velocity."""
    values, energy = measured_case(measured, "zero_vt")
    k, a, c, us, ud, uv = combine_materials(*MATERIAL, *MATERIAL)
    d, (px, py, _) = half_space_sphere(ZERO, UP, (0.0, 0.04, 0.0), 0.05, a)
    fx, fy, fz = contact_force(d, 0.05, k, c, us, ud, uv, 0.0, UP, (-0.3, 0.0, 0.0))
    assert (fx, fy, fz) == pytest.approx(values[0:3], rel=1e-9)
    assert (px - 0.0) * fy - (py - 0.04) * fx == pytest.approx(values[5], rel=1e-9)
    assert px * -fy - py * -fx == pytest.approx(values[11], rel=1e-9)
    assert contact_energy(d, 0.05, k) == pytest.approx(energy, rel=1e-9)


def test_half_space_has_no_bottom(measured):
    values, energy = measured_case(measured, "deep_plane")
    k, a, c, us, ud, uv = combine_materials(*MATERIAL, *MATERIAL)
    d, *_ = half_space_sphere(ZERO, UP, (0.0, -1.0, 0.0), 0.05, a)
    assert d == pytest.approx(1.05)
    force = contact_force(d, 0.05, k, c, us, ud, uv, 0.2, UP, ZERO)
    assert force[1] == pytest.approx(values[1], rel=1e-9)
    assert contact_energy(d, 0.05, k) == pytest.approx(energy, rel=1e-9)


@pytest.mark.parametrize("name", ["zero_radius", "zero_stiffness_one_side"])
def test_no_radius_or_no_stiffness_no_force(measured, name):
    values, energy = measured_case(measured, name)
    radius, stiffness = (0.0, 1e6) if name == "zero_radius" else (0.05, 0.0)
    k, a, *rest = combine_materials(*MATERIAL, stiffness, *MATERIAL[1:])
    d, *_ = half_space_sphere(ZERO, UP, (0.0, radius - 0.01, 0.0), radius, a)
    assert d > 0.0
    force = contact_force(d, radius, k, *rest, 0.2, UP, (0.3, 0.1, 0.0))
    assert list(force) == values[0:3] == [0.0, 0.0, 0.0]
    assert contact_energy(d, radius, k) == energy == 0.0


def test_no_stiffness_on_both_sides_is_no_force():
    """OpenSim computes NaN here, but a surface without stiffness cannot push."""
    k, a, *rest = combine_materials(0.0, *MATERIAL[1:], 0.0, *MATERIAL[1:])
    assert (k, a) == (0.0, 0.5)
    assert contact_force(0.01, 0.05, k, *rest, 0.2, UP, (0.3, 0.1, 0.0)) == ZERO
    assert contact_energy(0.01, 0.05, k) == 0.0


@pytest.mark.parametrize("stiffness", [(-1e6, 1e6), (1e6, -1.0)])
def test_negative_stiffness_is_refused(stiffness):
    with pytest.raises(ValueError, match="stiffness"):
        combine_materials(stiffness[0], *MATERIAL[1:], stiffness[1], *MATERIAL[1:])


def test_concentric_spheres_do_not_touch(measured):
    assert not any(measured_case(measured, "concentric")[0])
    assert sphere_sphere((1.0, 2.0, 3.0), 0.1, (1.0, 2.0, 3.0), 0.2, 0.5) == (0.0, 0.0, ZERO, ZERO)


def test_a_contact_without_depth_does_not_end_simbodys_loop():
    """Only what Simbody lists as a contact can return early, and a sphere above the plane is not listed."""
    apart = (-0.01, 0.05, 5e3, 1.0, 0.8, 0.4, 0.4, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0)
    pushing = (0.01, *apart[1:-2], 0.0, 0.0)
    both = contact_forces([apart, pushing], 0.2)
    assert both[0][1] != (0.0, 0.0, 0.0)
    assert contact_forces([apart, pushing], 0.2, simbody_early_return=True) == both


# ------------------------------------------------------------------------------------------------- pair order


def test_sweep_takes_the_axis_of_largest_spread_and_prunes():
    centres = [(0.0, 0.0, 0.0), (0.0, 3.0, 0.1), (0.0, 1.0, 0.2), (0.0, 1.05, 0.3)]
    assert simbody_pair_order(centres, [inf, 0.1, 0.1, 0.1]) == [(0, 2), (0, 3), (0, 1), (2, 3)]


def test_two_half_spaces_make_no_pair():
    assert simbody_pair_order([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], [inf, inf]) == []
    assert simbody_pair_order([(1.0, 0.0, 0.0), (0.0, 0.0, 0.0)], [0.1, inf]) == [(1, 0)]
    assert simbody_pair_order([], []) == []


coordinate = st.floats(-2.0, 2.0)
sphere = st.tuples(coordinate, coordinate, coordinate, st.floats(0.01, 0.5))


@given(st.lists(sphere, min_size=1, max_size=7))
def test_no_touching_pair_is_pruned(spheres):
    centres = [s[:3] for s in spheres]
    pairs = simbody_pair_order(centres, [s[3] for s in spheres])
    assert len({frozenset(pair) for pair in pairs}) == len(pairs)
    for j, b in enumerate(spheres):
        for i, a in enumerate(spheres[:j]):
            if sphere_sphere(a[:3], a[3], b[:3], b[3], 0.5)[0] > 1e-12:
                assert (i, j) in pairs or (j, i) in pairs


# ------------------------------------------------------------------------------------------------- properties

number = st.floats(-5.0, 5.0)
coefficient = st.floats(0.0, 2.0)
material = st.tuples(st.floats(1e3, 1e9), coefficient, coefficient, coefficient, coefficient)
depth = st.floats(1e-6, 0.1)
radius = st.floats(1e-3, 1.0)
slip_scale = st.floats(1e-3, 1.0)


@st.composite
def unit_vectors(draw):
    v = draw(st.tuples(number, number, number))
    norm = math.hypot(*v)
    assume(norm > 1e-2)
    return tuple(x / norm for x in v)


@st.composite
def contacts(draw):
    k, _, c, us, ud, uv = combine_materials(*draw(material), *draw(material))
    velocity = draw(st.tuples(number, number, number))
    return draw(depth), draw(radius), k, c, us, ud, uv, *draw(unit_vectors()), *velocity


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def law(contact, vt):
    return contact_force(*contact[:7], vt, contact[7:10], contact[10:])


@given(contacts(), slip_scale)
def test_surfaces_push_and_friction_opposes_slip(contact, vt):
    n, v = contact[7:10], contact[10:13]
    force = law(contact, vt)
    f = dot(force, n)
    scale = max(abs(x) for x in force)
    assert f >= -1e-12 * scale
    slip = [a - dot(v, n) * b for a, b in zip(v, n, strict=True)]
    friction = [a - f * b for a, b in zip(force, n, strict=True)]
    w = math.hypot(*slip)
    us, ud, uv = contact[4:7]
    if 2.0 * us >= ud:  # else the friction curve is negative below the transition velocity
        # Surface 1 drags surface 2 along in the direction of its slip.
        assert dot(friction, slip) >= -1e-9 * scale * (1.0 + w)
    bound = ud + 2.0 * abs(us - ud) + uv * w
    assert math.hypot(*friction) <= f * bound * (1 + 1e-9) + 1e-9 * scale


@given(contacts(), slip_scale)
def test_power_is_lost_and_never_made(contact, vt):
    """The power that the contact takes from the bodies is at least what the elastic Hertz force stores."""
    force = law(contact, vt)
    d, R, k = contact[:3]
    n, v = contact[7:10], contact[10:13]
    assume(2.0 * contact[4] >= contact[5])  # else friction drives, see above
    elastic = k * d * sqrt(R * k * d)
    power = dot(force, v) - 4.0 / 3.0 * elastic * dot(v, n)
    scale = abs(dot(force, v)) + elastic * math.hypot(*v)
    # If the slip is only a rounding error of v, friction has v / vt times the relative rounding
    # error.
    assert power >= -1e-10 * scale


@given(contacts(), slip_scale)
def test_exchanging_the_surfaces_turns_the_force_round(contact, vt):
    turned = (*contact[:7], *(-x for x in contact[7:10]), *(-x for x in contact[10:13]))
    assert law(turned, vt) == tuple(-x for x in law(contact, vt))


@given(material, material)
def test_exchanging_the_materials(first, second):
    k, a, *rest = combine_materials(*first, *second)
    k_turned, a_turned, *rest_turned = combine_materials(*second, *first)
    assert k == pytest.approx(k_turned, rel=1e-12)
    assert a == pytest.approx(1.0 - a_turned, abs=1e-12)
    assert rest == pytest.approx(rest_turned, rel=1e-9)


@given(sphere, sphere, st.floats(0.0, 1.0))
def test_exchanging_the_spheres(first, second, a):
    one, two = (first[:3], first[3]), (second[:3], second[3])
    d, R, n, P = sphere_sphere(*one, *two, a)
    d_turned, R_turned, turned, same = sphere_sphere(*two, *one, 1.0 - a)
    assert (d, R) == pytest.approx((d_turned, R_turned), abs=1e-12)
    if d > 0.0:
        assert n == pytest.approx([-x for x in turned], abs=1e-12)
        assert pytest.approx(same, abs=1e-9) == P


@given(contacts(), slip_scale, unit_vectors(), st.floats(0.0, 2.0))
def test_friction_is_continuous_at_the_transition_velocity(contact, vt, direction, approach):
    n = contact[7:10]
    tangent = [a - dot(direction, n) * b for a, b in zip(direction, n, strict=True)]
    norm = math.hypot(*tangent)
    assume(norm > 1e-2)
    forces = []
    for w in (vt * (1 - 1e-9), vt, vt * (1 + 1e-9)):
        v = [w * t / norm + approach * a for t, a in zip(tangent, n, strict=True)]
        forces.append(law((*contact[:10], *v), vt))
    f = dot(forces[1], n)
    us, uv = contact[4], contact[6]
    friction = [a - f * b for a, b in zip(forces[1], n, strict=True)]
    assert math.hypot(*friction) == pytest.approx(f * (us + uv * vt), rel=1e-6, abs=1e-9 * f)
    for before, at in ((forces[0], forces[1]), (forces[1], forces[2])):
        assert before == pytest.approx(at, abs=1e-7 * f)


@given(contacts(), slip_scale)
def test_force_vanishes_with_depth_and_with_slip(contact, vt):
    assert law((0.0, *contact[1:]), vt) == (0.0, 0.0, 0.0)
    assert max(map(abs, law((1e-200, *contact[1:]), vt))) < 1e-100
    n = contact[7:10]
    still = law((*contact[:10], 0.0, 0.0, 0.0), vt)
    assert still == pytest.approx([dot(still, n) * x for x in n], rel=1e-9)


@given(depth, radius, st.floats(1e2, 1e6))
def test_energy_derivative_is_the_elastic_force(d, R, k):
    h = 1e-5 * d
    slope = (contact_energy(d + h, R, k) - contact_energy(d - h, R, k)) / (2 * h)
    elastic = contact_force(d, R, k, 0.7, 0.8, 0.4, 0.4, 0.2, (0.0, 0.0, 1.0), ZERO)
    assert elastic[2] == pytest.approx(slope, rel=1e-7)


@given(contacts(), slip_scale, st.floats(-math.pi, math.pi))
def test_the_law_knows_no_frame(contact, vt, angle):
    """Rotating normal and velocity rotates the force."""
    cos, sin = math.cos(angle), math.sin(angle)

    def turn(v):
        return cos * v[0] - sin * v[1], sin * v[0] + cos * v[1], v[2]

    turned = law((*contact[:7], *turn(contact[7:10]), *turn(contact[10:13])), vt)
    expected = turn(law(contact, vt))
    elastic = contact[2] * contact[0] * sqrt(contact[1] * contact[2] * contact[0])
    assert turned == pytest.approx(expected, rel=1e-9, abs=1e-9 * elastic)


@given(
    st.tuples(*[number] * 3), unit_vectors(), st.tuples(*[number] * 3), radius, st.floats(0.0, 1.0)
)
def test_point_of_application_divides_the_overlap(o, n, c, r, a):
    d, P = half_space_sphere(o, n, c, r, a)
    if d > 0.0:
        # The fraction a of the depth is on the half space's side of the point, the rest between it
        # and the sphere's pole.
        assert dot([p - q for p, q in zip(P, o, strict=True)], n) == pytest.approx(-a * d, abs=1e-9)
        pole = [x - r * y for x, y in zip(c, n, strict=True)]
        assert math.dist(P, pole) == pytest.approx((1 - a) * d, abs=1e-9)


@pytest.mark.parametrize("place", range(13))
def test_what_is_not_a_number_is_not_hidden(place):
    contact = [0.01, 0.05, 5e3, 1.0, 0.8, 0.4, 0.4, 0.0, 1.0, 0.0, 0.3, 0.1, 0.2]
    contact[place] = math.nan
    assert any(map(math.isnan, law(contact, 0.2)))


# ------------------------------------------------------------------------------------------------- derivatives
@given(st.floats(1e-4, 0.02), st.floats(-0.3, 0.3), st.floats(1e-4, 0.5), st.floats(0.0, 6.3))
def test_derivatives_are_those_of_the_force(d, approach, slip, turn):
    numbers, n, h = (0.05, 4e3, 1.2, 0.8, 0.4, 0.1, 0.1), (0.0, 1.0, 0.0), 1e-6

    def force(deeper, faster):
        v = slip * math.cos(turn), approach + faster, slip * math.sin(turn)
        return np.array(contact_force(d + deeper, *numbers, n, v))

    by_depth, by_speed, across = contact_derivatives(
        d, *numbers, n, (slip * math.cos(turn), approach, slip * math.sin(turn))
    )
    there = force(0.0, 0.0)
    scale = max(1.0, there[1])
    assert by_depth == pytest.approx(
        (force(d * h, 0.0) - force(-d * h, 0.0))[1] / (2.0 * d * h), abs=1e-5 * scale / d
    )
    assert by_speed == pytest.approx(
        (force(0.0, h) - force(0.0, -h))[1] / (2.0 * h), abs=1e-3 * scale
    )
    assert across * slip == pytest.approx(math.hypot(there[0], there[2]), rel=1e-9)


def test_without_slip_friction_grows_in_proportion():
    numbers, n = (0.05, 4e3, 1.2, 0.8, 0.4, 0.1, 0.1), (0.0, 1.0, 0.0)
    _, _, still = contact_derivatives(0.01, *numbers, n, ZERO)
    _, _, slow = contact_derivatives(0.01, *numbers, n, (1e-6, 0.0, 0.0))
    assert still == pytest.approx(slow, rel=1e-4)
    assert contact_derivatives(-0.01, *numbers, n, ZERO) == (0.0, 0.0, 0.0)
