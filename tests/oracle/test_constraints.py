"""Compare constraints, prescribed coordinates and closed loops with a live OpenSim 4.6, in small models."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.mechanics.multibody import Mechanism, build_mechanism
from osimlite.mechanics.multibody.mechanism import MassProperties
from tests.oracle.opensim_runs import put
from tests.oracle.support import (
    CASES,
    Bodies,
    Change,
    build_printed,
    make_constrained_chain,
    make_coupler,
    make_linear_function,
    make_vec3,
    opensim,
)

pytestmark = pytest.mark.oracle


def _rolling(model: Any, bodies: Bodies) -> None:
    """Add a RollingOnSurfaceConstraint, which OpenSim's Python module can only read from a file."""
    text = """<?xml version="1.0"?><OpenSimDocument Version="40600"><RollingOnSurfaceConstraint name="roll">
        <socket_rolling_body>/bodyset/loose</socket_rolling_body>
        <socket_surface_body>/bodyset/outer</socket_surface_body>
        <surface_normal>0 1 0</surface_normal><surface_height>0.4</surface_height>
        </RollingOnSurfaceConstraint></OpenSimDocument>"""
    with NamedTemporaryFile("w", suffix=".xml") as file:
        file.write(text)
        file.flush()
        constraint = opensim.Constraint.safeDownCast(
            opensim.OpenSimObject.makeObjectFromFile(file.name)
        )
    model.addConstraint(constraint.clone())


LOOP = (
    make_vec3(0.1, 0.0, 0.2),
    make_vec3(0.3, 0.2, 0.1),
    make_vec3(0.0, 0.1, 0.0),
    make_vec3(0.1, 0.3, 0.2),
)


def _weld_like_loop(model: Any, bodies: Bodies) -> None:
    model.addConstraint(opensim.WeldConstraint("weld", bodies[2], *LOOP[:2], bodies[1], *LOOP[2:]))


def _loop(kind: str, count: int) -> Change:
    """Return a function that adds a joint from the floating body to the outer one, which closes a loop."""

    def add(model: Any, bodies: Bodies) -> None:
        joint = getattr(opensim, kind)(
            "loop",
            bodies[2],
            make_vec3(0.1, 0.0, 0.2),
            make_vec3(0.3, 0.2, 0.1),
            bodies[1],
            make_vec3(0.0, 0.1, 0.0),
            make_vec3(0.1, 0.3, 0.2),
        )
        for index in range(count):
            joint.upd_coordinates(index).setName(f"loop_{index}")
        model.addJoint(joint)

    return add


def test_a_coupler_by_a_constant_binds_the_dependent_coordinate(tmp_path: Path) -> None:
    """A coupler with a constant function determines the dependent coordinate.

    OpenSim constrains the first independent coordinate instead, and leaves the dependent one free.
    """
    model, bodies = make_constrained_chain(np.random.default_rng(15))
    make_coupler(("pin_0",), "free_3", opensim.Constant(0.25))(model, bodies)
    mechanism = build_printed(model, tmp_path)
    model, state, coordinates = _loaded(tmp_path, mechanism)
    pin, free = (mechanism.coordinate_index(name) for name in ("pin_0", "free_3"))
    values = mechanism.values({})
    for index, coordinate in enumerate(coordinates):
        coordinate.setValue(state, float(values[index]), False)
    model.realizePosition(state)
    assert state.getQErr().to_numpy() == pytest.approx([0.25 - values[pin]])
    (ours,) = (item.position_errors(mechanism.at(values)) for item in mechanism.constraints)
    assert ours == pytest.approx([0.25 - values[free]])


def _no_further_than(mechanism: Mechanism, ours: Any, theirs: Any) -> None:
    """Assert that our default pose is at least as near to the default values as OpenSim's.

    The assertion is skipped if OpenSim's pose violates the constraints.
    """
    wanted, state = mechanism.values({}), mechanism.at(theirs)
    if any(
        np.abs(item.position_errors(state)).max(initial=0.0) > 1e-9
        for item in mechanism.constraints
    ):
        # OpenSim never assembles loops that only joints close, and its assembly cannot always reach
        # its target.
        return
    counted = np.array([not info.yielding for info in mechanism.coordinates])
    our_cost, their_cost = (float(np.sum((counted * (q - wanted)) ** 2)) for q in (ours, theirs))
    assert our_cost <= their_cost * (1.0 + 1e-9) + 1e-12
    if our_cost >= their_cost * (1.0 - 1e-6):
        assert ours == pytest.approx(theirs, abs=1e-5)


def _loaded(folder: Path, mechanism: Mechanism) -> tuple[Any, Any, list[Any]]:
    model = opensim.Model(str(folder / "model.osim"))
    state = model.initSystem()
    coordinates = [
        model.getCoordinateSet().get(index) for index in range(len(mechanism.coordinates))
    ]
    assert [item.getAbsolutePathString() for item in coordinates] == [
        info.path for info in mechanism.coordinates
    ]
    return model, state, coordinates


def _numbers(what: str, state: Any, coordinates: list[Any]) -> Any:
    return np.array([getattr(item, f"get{what}Value")(state) for item in coordinates])


def _go(
    rng: np.random.Generator, mechanism: Mechanism, state: Any, coordinates: list[Any]
) -> tuple[Any, Any, float]:
    """Move both models to the same random state that fulfils the constraints.

    Returns:
        Coordinates, speeds and time (s).
    """
    time = float(rng.uniform(0.0, 2.0))
    q, _ = mechanism.default_state()
    moved = [0.0 if info.locked else rng.uniform(-0.2, 0.2) for info in mechanism.coordinates]
    q = mechanism.assemble(q + moved, time)
    u = mechanism.project_speeds(q, rng.uniform(-1.0, 1.0, len(q)), time)
    state.setTime(time)
    put(coordinates, state, q, u)
    return q, u, time


def _unbroken(model: Any, state: Any) -> None:
    """Assert that OpenSim too finds no violation of the constraints in the state."""
    model.realizeAcceleration(state)
    for errors in (state.getQErr(), state.getUErr()):
        assert np.abs(errors.to_numpy()).max() < 1e-8


@pytest.mark.parametrize("case", CASES)
def test_constrained_motion(case: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    model, bodies = make_constrained_chain(rng)
    CASES[case](model, bodies)
    mechanism = build_printed(model, tmp_path)
    model, state, coordinates = _loaded(tmp_path, mechanism)
    _no_further_than(mechanism, mechanism.default_state()[0], _numbers("", state, coordinates))
    for _ in range(3):
        q, u, time = _go(rng, mechanism, state, coordinates)
        _unbroken(model, state)
        udot = _numbers("Acceleration", state, coordinates)
        result = mechanism.acceleration(q, u, time=time)
        assert np.abs(result - udot).max() < 1e-9 * (1.0 + np.abs(udot).max())


@pytest.mark.parametrize(
    ("kind", "count"), [("PinJoint", 1), ("BallJoint", 3), ("UniversalJoint", 2)]
)
def test_a_loop_splits_a_body(kind: str, count: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(12)
    model, bodies = make_constrained_chain(rng)
    _loop(kind, count)(model, bodies)
    mechanism = build_printed(model, tmp_path)
    model, state, coordinates = _loaded(tmp_path, mechanism)
    assert mechanism.total_mass == pytest.approx(model.getTotalMass(state), rel=1e-14)
    # OpenSim uses the unit inertia about the origin of the body as the inertia of the half that it
    # adds.
    half = mechanism.bodies[-1]
    properties, arm = half.mass_properties, half.mass_properties.center
    wrong = properties.inertia / properties.mass + (arm @ arm) * np.eye(3) - np.outer(arm, arm)
    spoilt = replace(half, mass_properties=MassProperties(properties.mass, arm, wrong))
    theirs = replace(mechanism, bodies=(*mechanism.bodies[:-1], spoilt))
    for _ in range(3):
        q, u, time = _go(rng, mechanism, state, coordinates)
        _unbroken(model, state)
        udot = _numbers("Acceleration", state, coordinates)
        assert np.abs(theirs.acceleration(q, u, time=time) - udot).max() < 1e-9 * (
            1.0 + np.abs(udot).max()
        )


def test_a_weld_that_closes_a_loop_is_a_constraint(tmp_path: Path) -> None:
    built = []
    for change in (_loop("WeldJoint", 0), _weld_like_loop):
        model, bodies = make_constrained_chain(np.random.default_rng(13))
        change(model, bodies)
        built.append(build_printed(model, tmp_path))
    by_joint, by_constraint = built
    assert by_joint.total_mass == by_constraint.total_mass
    q, _ = by_joint.default_state()
    u = by_joint.project_speeds(q, np.random.default_rng(1).uniform(-1.0, 1.0, len(q)))
    assert by_joint.acceleration(q, u) == pytest.approx(by_constraint.acceleration(q, u), abs=1e-12)


def test_rolling_acts_when_asked_for(tmp_path: Path) -> None:
    """OpenSim does not enforce rolling by default, and finds no violation in our states once enforced."""
    rng = np.random.default_rng(14)
    model, bodies = make_constrained_chain(rng)
    _rolling(model, bodies)
    plain = build_printed(model, tmp_path)
    mechanism = build_mechanism(osimlite.read(tmp_path / "model.osim"), rolling=True)
    model, state, coordinates = _loaded(tmp_path, mechanism)
    roll = model.getConstraintSet().get("roll")
    assert not roll.isEnforced(state)
    assert plain.constraints == ()
    q, u, _ = _go(rng, mechanism, state, coordinates)
    assert roll.setIsEnforced(state, True)
    _unbroken(model, state)
    assert len(state.getUErr().to_numpy()) == 4
    assert len(mechanism.constraints[0].velocity_equations(mechanism.at(q, u))[1]) == 4


@pytest.mark.parametrize(("accuracy", "off"), [(1e-9, 5e-11), (1e-9, 1e-3), (1e-3, 5e-5)])
def test_a_motion_starts_at_opensims_pose(accuracy: float, off: float, tmp_path: Path) -> None:
    """OpenSim leaves a pose within a tenth of the assembly accuracy unchanged.

    Only its integrator then projects the pose onto the constraints, by the shortest way.
    """
    model, bodies = make_constrained_chain(np.random.default_rng(14))
    make_coupler(("ball_0",), "pin_0", make_linear_function((1.0, 0.0)))(model, bodies)
    model.set_assembly_accuracy(accuracy)
    model.updJointSet().get("pin").upd_coordinates(0).set_default_value(0.2 + off)
    mechanism = build_printed(model, tmp_path)
    model, state, coordinates = _loaded(tmp_path, mechanism)
    manager = opensim.Manager(model)
    manager.initialize(state)
    theirs = _numbers("", manager.getState(), coordinates)
    assert mechanism.default_state()[0] == pytest.approx(theirs, abs=1e-13)
