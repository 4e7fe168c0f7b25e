"""Tests of motions that kernels assemble, against the search in Python, for random mechanisms."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import osimlite
from osimlite.errors import SimulationError
from osimlite.mechanics.kernels.linear_algebra import diagonalize
from osimlite.mechanics.multibody import Mechanism, build_mechanism
from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.assembly import tolerance_of
from osimlite.mechanics.multibody.constraints import Coupler, PrescribedCoordinate
from osimlite.mechanics.multibody.linear import solve_with_null_space
from osimlite.simulation.engines.linking import MACHINE_CODE, PYTHON_CODE, Code
from osimlite.simulation.pose_assembly import assemble_motion
from osimlite.simulation.recorded_motion import RecordedMotion
from tests.mechanics.multibody.strategies import KINDS, Case, cases, constraint_of
from tests.simulation.checked import Checked
from tests.suite import choose


def change_of(mechanism: Mechanism, poses: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return the squared change of each pose that assembly minimizes."""
    counted = np.array([not info.yielding for info in mechanism.coordinates])
    return ((poses - wanted) ** 2 * counted).sum(axis=1)


def compare(
    mechanism: Mechanism,
    wanted: np.ndarray,
    code: Code = MACHINE_CODE,
    accuracy: float = 1e-9,
    uncertain: tuple[int, ...] = (),
) -> None:
    """Compare assembled poses with those of the search in Python, at a time of 0.7 s.

    Args:
        mechanism: the mechanism.
        wanted: poses to start from (p, n).
        code: code of the kernels.
        accuracy: largest difference of a coordinate (m or rad).
        uncertain: indices of coordinates that may differ by more.
    """
    known = np.array([mechanism.assemble(q, 0.7) for q in wanted])
    result = assemble_motion(mechanism, np.full(len(wanted), 0.7), wanted, code)
    for q in result:
        state = mechanism.at(q, time=0.7)
        errors = np.concatenate([item.position_errors(state) for item in mechanism.constraints])
        assert np.abs(errors).max(initial=0.0) <= tolerance_of(mechanism)
    least, change = change_of(mechanism, known, wanted), change_of(mechanism, result, wanted)
    # An error of `accuracy` along the constraints changes the squared distance to first order.
    assert (np.abs(change - least) <= 1e-12 + 2.0 * np.sqrt(least) * accuracy).all()
    certain = np.delete(result - known, uncertain, axis=1)
    assert np.abs(certain).max(initial=0.0) < accuracy


@settings(max_examples=choose(8, 80))
@given(
    cases(max_bodies=4),
    st.sampled_from(KINDS),
    st.integers(0, 2**32 - 1),
    st.sampled_from(("free", "locked", "clamped", "yielding")),
    st.sampled_from((1e-3, 0.02)),
)
def test_any_mechanism(case: Case, kind: str, seed: int, what: str, off: float) -> None:
    assume(len(case.q))
    rng = np.random.default_rng(seed)
    place = int(rng.integers(len(case.q)))
    infos = list(case.mechanism.coordinates)
    constraint = constraint_of(kind, case.mechanism, rng)
    mechanism = replace(case.mechanism, constraints=(constraint,))
    try:
        near = mechanism.assemble(case.q, 0.7)
    except SimulationError:
        return
    # Where the equations are almost singular, the nearest pose is ill-conditioned.
    rows = constraint.velocity_equations(mechanism.at(near, time=0.7))[0]
    strengths = np.linalg.svd(rows, compute_uv=False)
    assume(strengths.min(initial=1.0) > 1e-2 * strengths.max(initial=1.0))
    wanted = near + off * rng.normal(size=(choose(2, 4), len(near)))
    changes: dict[str, dict[str, Any]] = {
        "free": {},
        "locked": {"locked": True},
        "clamped": {"clamped": True, "range": (near[place] - 0.3 * off, near[place] + 0.3 * off)},
        "yielding": {"yielding": True},
    }
    infos[place] = replace(infos[place], **changes[what])
    mechanism = replace(mechanism, coordinates=tuple(infos))
    try:
        [mechanism.assemble(q, 0.7) for q in wanted]
    except SimulationError:
        with pytest.raises(SimulationError):
            assemble_motion(mechanism, np.full(len(wanted), 0.7), wanted, MACHINE_CODE)
        return
    # A coordinate that does not count is as uncertain as those that it moves, over its effect.
    tangents = np.delete(solve_with_null_space(rows, np.zeros(len(rows)))[1], place, axis=0)
    effects = np.linalg.svd(tangents, compute_uv=False)
    is_uncertain = what == "yielding" and effects.min(initial=1.0) < 1e-2
    compare(mechanism, wanted, accuracy=1e-7, uncertain=(place,) if is_uncertain else ())


def build_tree() -> Mechanism:
    """Return a tree with joints of many kinds, with a coupler, a prescribed and a clamped coordinate."""
    root = osimlite.read("fixtures/kinematics/mixed_joint_tree.osim")
    mechanism = build_mechanism(root)
    infos = list(mechanism.coordinates)
    infos[6] = replace(infos[6], yielding=True)
    infos[9] = replace(infos[9], clamped=True, range=(-0.05, 0.05))
    couplers = (
        Coupler(6, (0, 1, 9), f.WeightedSum((0.4, -0.3, 0.2), 0.1)),
        PrescribedCoordinate(3, f.SineWave(0.4, 3.0, 0.2, 0.1)),
    )
    return replace(mechanism, coordinates=tuple(infos), constraints=couplers)


@pytest.mark.parametrize(
    "code", [MACHINE_CODE, PYTHON_CODE, Checked("Python")], ids=["compiled", "Python", "bounded"]
)
def test_couplers_prescribed_and_clamped_coordinates(
    code: Code, monkeypatch: pytest.MonkeyPatch, fixtures
) -> None:
    monkeypatch.chdir(fixtures.parent)
    mechanism = build_tree()
    rng = np.random.default_rng(1)
    compare(
        mechanism,
        mechanism.values({})
        + 0.3 * rng.normal(size=(3 if code is MACHINE_CODE else 1, len(mechanism.coordinates))),
        code,
    )


@pytest.mark.parametrize("code", [MACHINE_CODE, PYTHON_CODE], ids=["compiled", "Python"])
def test_a_direction_that_only_the_constraint_curves(code: Code) -> None:
    """A coordinate that does not count moves far, because it hardly moves the one that counts.

    Along x = 0.1 y² + 1e-4 y + 0.2, the cost (x - 0.201)² / 2 has the curvature 1e-8 at y = 0 without
    that of the constraint, which is 20,000 times as large.
    """
    model = osimlite.Model(name="two")
    for number in range(2):
        body = model.add(
            osimlite.Body(name=f"b{number}", mass=1.0, inertia=(0.1, 0.1, 0.1, 0.0, 0.0, 0.0))
        )
        model.add(osimlite.PinJoint(name=f"j{number}").between(model.ground, body))
    mechanism = build_mechanism(model)
    infos = (mechanism.coordinates[0], replace(mechanism.coordinates[1], yielding=True))
    coupler = Coupler(0, (1,), f.Polynomial((0.1, 1e-4, 0.2)))
    mechanism = replace(mechanism, coordinates=infos, constraints=(coupler,))
    wanted = np.array(((0.201, 0.0),))
    compare(mechanism, wanted, code, accuracy=1e-7)
    y = (-1e-4 + np.sqrt(1e-8 + 4e-4)) / 0.2
    result = assemble_motion(mechanism, np.full(1, 0.7), wanted, code)
    assert result[0] == pytest.approx((0.201, y), abs=1e-7)


def test_loops(fixtures) -> None:
    """Start far from the constraints, where their curvature matters."""
    model = osimlite.Model(name="loop")
    last = model.ground
    for number in range(4):
        body = model.add(
            osimlite.Body(name=f"b{number}", mass=1.0, inertia=(0.1, 0.1, 0.1, 0.0, 0.0, 0.0))
        )
        joint = osimlite.PinJoint(name=f"j{number}")
        model.add(joint.between(last, body, at=(0.0, -0.4 if number else 0.0, 0.0)))
        last = body
    model.add(
        osimlite.PointConstraint(
            name="end", socket_body_1=model.ground, location_body_1=(0.7, -0.6, 0.0),
            socket_body_2=last, location_body_2=(0.0, -0.4, 0.0),
        )
    )  # fmt: skip
    mechanism = build_mechanism(model)
    rng = np.random.default_rng(2)
    wanted = np.array((0.3, 0.6, 0.4, 0.3)) + 0.2 * rng.normal(size=(20, 4))
    compare(mechanism, wanted, accuracy=1e-8)
    compare(mechanism, wanted[: choose(1, 2)], Checked("Python"), accuracy=1e-8)
    motion = RecordedMotion(mechanism, np.linspace(0.0, 1.0, 20), wanted).assemble_poses()
    assert np.abs(motion.values - [mechanism.assemble(q) for q in wanted]).max() < 1e-8
    model["/constraintset/end"].location_body_1 = (9.0, 0.0, 0.0)
    with pytest.raises(
        SimulationError,
        match="no pose of 'loop' near the requested pose fulfils /constraintset/end",
    ):
        assemble_motion(build_mechanism(model), np.zeros(20), wanted)


@pytest.mark.parametrize("scale", [1.0, 1e-20, 1e20])
@pytest.mark.parametrize("size", [1, 2, 5, 12])
def test_eigenvalues(size: int, scale: float) -> None:
    """The search ends by the ratio of matrix entries, so that their magnitude does not matter."""
    matrix = scale * np.random.default_rng(size).normal(size=(size, size))
    matrix += matrix.T
    work, vectors = matrix.copy().reshape(-1), np.zeros(size * size)
    diagonalize(size, work, vectors)
    values, rows = work.reshape(size, size).diagonal(), vectors.reshape(size, size)
    assert np.sort(values) == pytest.approx(np.linalg.eigvalsh(matrix), abs=scale * 1e-13)
    assert rows @ rows.T == pytest.approx(np.eye(size), abs=1e-13)
    assert rows.T @ np.diag(values) @ rows == pytest.approx(matrix, abs=scale * 1e-13)
