"""Tests of tangents by machine code: they are compared with those of Python numbers that carry derivatives."""

from __future__ import annotations

import ctypes
import math
from functools import cache
from math import (
    acos,
    asin,
    atan,
    atan2,
    copysign,
    cos,
    cosh,
    erf,
    erfc,
    exp,
    floor,
    isfinite,
    isnan,
    log,
    radians,
    sin,
    sinh,
    sqrt,
    tan,
    tanh,
)

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import osimlite
from osimlite.errors import SettingError, SimulationError
from osimlite.mechanics.codegen.toolchain import CompilationError
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.table import LAW_MODULES
from osimlite.mechanics.laws.dual_numbers import differentiate_root, is_exact_zero
from osimlite.models.jumper import jumper
from osimlite.models.walkers import furthest_walker
from osimlite.simulation.elements.force_type import ForceType
from osimlite.simulation.elements.laws import ALONG, DIRECTIONS, RIGID, WITHOUT_DERIVATIVES
from osimlite.simulation.elements.registry import FORCE_TYPES
from osimlite.simulation.engines.compiled_laws import compile_function
from osimlite.simulation.engines.machine_code import prepare_laws
from osimlite.simulation.pack import pack
from tests.conftest import ROOT, SHARED
from tests.derivatives.jets import Jet, differentiate_by_jets, use_jets
from tests.derivatives.machine import off, slope

WAYS = 3
"""Number of directions in the tests of single functions."""


def either(a: float, b: float) -> float:
    """Return a number; the function has several return statements and swaps tuples with and without derivatives."""
    if a > b:
        return 1.0
    low, high = (a, 2.0) if a <= 0.0 else (b, a)
    for _ in range(3):
        low, high = high, 0.5 * low
    return low * high if a != b else a


def rules(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, count: int) -> int:
    """Apply every operation and function that kernels may apply to numbers."""
    a, b = y[0], y[1]
    found = at(f, 1)
    f[0], found[0], found[1] = a + b, a - b, 2.0 - a
    f[3], f[4], f[5] = a * b, a / b, 3.0 / b
    f[6], f[7], f[8], f[9] = a**2, b**a, b**-1.5, 2.0**a
    f[10], f[11], f[12] = sin(a) + cos(b), tan(a), asin(0.3 * tanh(a)) + acos(0.5 * tanh(a))
    f[13], f[14], f[15] = atan(a) + exp(0.1 * a), log(b), sinh(a) - cosh(b)
    f[16], f[17], f[18] = sqrt(b), erf(a) + erfc(b), radians(a)
    f[19], f[20], f[21] = atan2(a, b), abs(a) - -b, copysign(a, -b)
    f[22], f[23], f[24] = min(a, b, 0.7), max(1, a), (a + 5.0 * b) % b
    f[25], f[26] = either(a, b), either(b, a)
    f[27] = floor(a) + int(b) * a + (a if isfinite(b) and not isnan(a) else 0.0)
    total, k = 0.0, 0
    while total < 2.0 * b:
        total += b / (1.0 + k)
        k += 1
    f[28] = total
    f[29] = 3 if a else float(b)
    f[30] = x[0] * a + x[1]
    f[30] *= b
    return k


rules.__module__ = either.__module__ = "osimlite.canary"


def searched(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, count: int) -> int:
    """Compute a root of r r = a by `count` Newton steps, and terms that depend on zero tests."""
    root = x[0]
    for _ in range(count):
        root -= (root * root - y[0]) / (2.0 * root)
    f[0], f[1] = root, differentiate_root(root, root * root - y[0], 2.0 * root)
    f[2] = 0.0 if is_exact_zero(y[1]) else 5.0 * y[1]
    f[3] = 0.0 if y[1] == 0.0 else 5.0 * y[1]
    return count


searched.__module__ = "osimlite.canary"


@cache
def machine_code(function):
    address = compile_function(function.__name__, function, WAYS)
    code = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * 5, ctypes.c_int64)(address)

    def called(count, x, y):
        s, w, f = np.zeros(1, dtype=np.int64), np.zeros((1, 1 + WAYS)), np.zeros((40, 1 + WAYS))
        result = code(*(v.ctypes.data for v in (s, x, w, y, f)), count)
        return result, f

    return called


def strange(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, count: int) -> int:
    """Call a function that no law calls."""
    f[0] = math.lgamma(y[0])
    return count


strange.__module__ = "osimlite.canary"


def test_what_has_no_rule_is_refused_by_name():
    with pytest.raises(CompilationError, match=r"'strange' cannot be compiled: .*lgamma"):
        compile_function("strange", strange, WAYS)


numbers = st.floats(-3.0, 3.0), st.floats(0.05, 4.0)


# At a corner of a function the values themselves decide, and the sign of a zero.
@example(0.0, 1.0, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
@example(-0.0, 1.0, [1.0, -1.0, 0.5, 0.0, 1.0, 2.0])
@example(1.0, 1.0, [1.0, -1.0, 0.5, 0.0, 1.0, 2.0])
@example(0.7, 0.7, [1.0, -1.0, 0.5, 0.0, 1.0, 2.0])
@given(*numbers, st.lists(st.floats(-2.0, 2.0), min_size=2 * WAYS, max_size=2 * WAYS))
def test_every_rule_is_that_of_python(a, b, along):
    y = np.column_stack(([a, b], np.reshape(along, (2, WAYS))))
    x = np.column_stack(([1.5, -0.5], np.full((2, WAYS), 0.25)))
    steps, found = machine_code(rules)(0, x, y)
    none = np.zeros(WAYS)
    jets = [
        np.array([Jet(row[0], row[1:], 0.0, none) for row in rows] + [None], dtype=object)[:-1]
        for rows in (x, y)
    ]
    wanted = np.zeros(40, dtype=object)
    with use_jets([rules]):
        assert rules(np.zeros(1), jets[0], wanted, jets[1], wanted, 0) == steps
    for row, jet in zip(found, wanted, strict=True):
        value, change = (jet.v, jet.g) if isinstance(jet, Jet) else (float(jet), none)
        size = 1.0 + np.abs(change).max() + abs(value)
        assert (
            abs(row[0] - value) <= 1e-14 * size and np.abs(row[1:] - change).max() <= 1e-13 * size
        )


def test_a_root_has_the_derivatives_of_its_equation():
    """After zero steps, the derivatives of the root are those of the starting point and of the equation."""
    y = np.array([[4.0, 1.0, 0.0, 2.0], [0.0, 0.0, 1.0, 0.0]])
    _, found = machine_code(searched)(0, np.array([[2.0, 7.0, 7.0, 7.0]]), y)
    assert found[0].tolist() == [2.0, 7.0, 7.0, 7.0] and found[1].tolist() == [2.0, 0.25, 0.0, 0.5]
    # `is_exact_zero` holds if the number and its derivatives are zero; `==` compares values only.
    assert found[2].tolist() == [0.0, 0.0, 5.0, 0.0] and found[3].tolist() == [0.0] * 4
    _, found = machine_code(searched)(5, np.array([[2.1, 7.0, 7.0, 7.0]]), y)
    assert found[1] == pytest.approx([2.0, 0.25, 0.0, 0.5], abs=1e-15)


OF_RATES = [name for name in LAW_MODULES if name not in WITHOUT_DERIVATIVES]
OF_RATES += [
    kind.name + form
    for kind in FORCE_TYPES
    if isinstance(kind, ForceType)
    for form in ("", RIGID)[: 1 + bool(kind.rigid_law)]
]


@pytest.mark.parametrize("name", OF_RATES)
def test_every_kernel_has_derivatives(name):
    prepare_laws([f"{name}{ALONG}{DIRECTIONS}"])


def model_named(name):
    if name == "tree":
        return osimlite.read(ROOT / "fixtures/kinematics/mixed_joint_tree.osim")
    if name in (jumper, furthest_walker):
        return name()
    for path in SHARED.glob(f"corpus/models/{name}/*.osim"):
        return osimlite.read(path)
    return pytest.skip("needs the shared reference folder, which is not beside this repository")


@pytest.mark.parametrize("name", ["tree", furthest_walker, jumper, "m0097", "m0115"])
def test_whole_models(name):
    """Compare complete models with joints, contact, constraints and muscles around surfaces."""
    made = osimlite.tangents(model_named(name))
    rng, size, moving = np.random.default_rng(1), len(made.states), 2 * len(made.coordinates)
    x, u = made.x.copy(), rng.uniform(0.05, 0.95, len(made.controls))
    x[:moving] += 0.1 * rng.normal(size=moving)
    x[moving:] = np.where(x[moving:] == 0.0, 0.1, x[moving:]) * rng.uniform(
        0.95, 1.05, size - moving
    )
    rates, a, b = made.linear(0.3, x, u)
    y = np.zeros(size)
    y[made.state_indices] = x
    value, wanted, _ = differentiate_by_jets(
        pack(made.mechanism, made.forces), 0.3, y.tolist(), u.tolist(), np.zeros(size)
    )
    places = np.ix_(made.state_indices, made.state_indices)
    sizes = np.maximum(1.0, np.abs(a).max(axis=1, keepdims=True))
    assert (
        off(rates, value[made.state_indices]) < 1e-12
        and (np.abs(a - wanted[places]) / sizes).max() < 1e-12
    )
    # A direction has the same derivatives when it is evaluated alone.
    along = rng.normal(size=(size + len(u), 1))
    _, change = made.differentiate_along(0.3, x, u, along[:size], along[size:])
    assert (
        np.abs(change - np.hstack((a, b)) @ along).max()
        < 1e-12 * np.abs(np.hstack((a, b))).max() * np.abs(along).sum()
    )
    # Differences check what jets do not: searches have the derivatives of their roots, not those of
    # their steps.
    none = np.zeros((size, 0))

    def moved(h):
        return made.differentiate_along(
            0.3, x + h * along[:size, 0], u + h * along[size:, 0], none
        )[0]

    assert (
        np.abs(slope(moved, 1e-5) - change[:, 0]) / (sizes[:, 0] * np.abs(along).sum())
    ).max() < 1e-7


def test_what_is_nothing_now_may_be_something_next():
    """A motionless mechanism needs no constraint forces, but their derivatives count although the forces are 0."""
    model = osimlite.Model(name="gears", gravity=(0.0, 0.0, 0.0))
    for name in ("one", "two"):
        body = model.add(
            osimlite.Body(
                name=name, mass=1.0, mass_center=(0.0, 0.3, 0.0), inertia=(1, 1, 1, 0, 0, 0)
            )
        )
        turn = osimlite.Coordinate(name=f"turn_{name}")
        model.add(
            osimlite.PinJoint(name=f"axle_{name}", coordinates=[turn]).between(model.ground, body)
        )
    model.add(osimlite.CoordinateActuator(name="motor", coordinate="turn_one", optimal_force=1.0))
    model.add(osimlite.CoordinateCouplerConstraint(
        name="gear", independent_coordinate_names=("turn_one",), dependent_coordinate_name="turn_two",
        coupled_coordinates_function=osimlite.LinearFunction(coefficients=(1.0, 0.0)),
    ))  # fmt: skip
    near = osimlite.linearize(model)
    inertia = 1.0 + 0.3**2
    assert near.B[2:, 0] == pytest.approx(0.5 / inertia) and not near.xdot.any()


def test_parameters():
    model = furthest_walker()
    made = osimlite.tangents(model, ["/bodyset/Pelvis/mass"])
    x = made.x + 0.05

    def rates(p):
        made.take(np.array([p]))
        return made.differentiate_along(0.0, x, made.u, np.zeros((len(x), 0)))[0]

    mass = float(made.p[0])
    wanted = slope(lambda h: rates(mass + h), 1e-2)
    made.take(np.array([mass]))
    _, found = made.differentiate_along(
        0.0, x, made.u, np.zeros((len(x), 1)), None, np.ones((1, 1))
    )
    assert np.abs(found[:, 0] - wanted).max() < 1e-9 * np.abs(wanted).max()
    # A direction of parameters does not remain for the next call.
    assert not made.differentiate_along(0.0, x, made.u, np.zeros((len(x), 1)))[1].any()


def test_what_has_no_mass_has_no_accelerations():
    model = osimlite.Model(name="massless")
    body = model.add(osimlite.Body(name="body", mass=0.0))
    turn = osimlite.Coordinate(name="q")
    model.add(osimlite.PinJoint(name="joint", coordinates=[turn]).between(model.ground, body))
    assert "mass_center" in osimlite.tangents(model).output_names
    with pytest.raises(SimulationError, match="no accelerations in this state"):
        osimlite.linearize(model, outputs=["mass_center"])


def test_what_is_not_there_is_refused():
    with pytest.raises(SettingError, match="no number '/bodyset/Pelvis/mas'"):
        osimlite.tangents(furthest_walker(), ["/bodyset/Pelvis/mas"])
    with pytest.raises(SettingError, match="no output 'mass_centre'; did you mean 'mass_center'"):
        osimlite.linearize(furthest_walker(), outputs=["mass_centre"])


@pytest.mark.parametrize("name", [furthest_walker, "m0036", "m0115"])
def test_outputs_have_derivatives(name):
    """Compare derivatives of positions, mass centre, contacts, muscles and probes with differences of these outputs."""
    made = osimlite.tangents(model_named(name))
    rng, size, moving = np.random.default_rng(2), len(made.states), 2 * len(made.coordinates)
    x, u = made.x.copy(), rng.uniform(0.1, 0.9, len(made.controls))
    x[:moving] += 0.02 * rng.normal(size=moving)
    x[moving:] = np.where(x[moving:] == 0.0, 0.1, x[moving:]) * rng.uniform(
        0.97, 1.03, size - moving
    )
    groups = [group for group, labels in made.output_names.items() if labels]
    assert {"stations", "mass_center", "contact_forces", "forces", "probes"} & {*groups} == {
        *groups
    } - {
        "station_velocities",
        "mass_center_velocity",
    }
    near = osimlite.linearize(made, x, u, outputs=groups)
    assert (
        len(near.outputs) == len(near.y) == sum(map(len, made.output_names.values()))
        and near.C.shape[1] == size
    )
    chosen = [(group, k) for group in groups for k in range(len(made.output_names[group]))]
    along = rng.normal(size=size + len(u))

    def moved(h):
        return made.compute_outputs(0.0, x + h * along[:size], u + h * along[size:], chosen)[0]

    both = np.hstack((near.C, near.D))
    off_by, sizes = np.abs(slope(moved, 1e-5) - both @ along), np.abs(both) @ np.abs(along)
    for group in groups:
        rows = [k for k, (own, _) in enumerate(chosen) if own == group]
        assert off_by[rows].max() < 1e-7 * max(1.0, sizes[rows].max()), group
    assert near.C.any() and np.array_equal(near.A, made.linear(0.0, x, u)[1])
