"""Tests of custom joints and constraints: accelerations by Bullet against the recursion, energy, initial states."""

from __future__ import annotations

import gzip
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import osimlite
from osimlite import Body, Coordinate, Model
from osimlite.errors import SimulationError, UnsupportedError
from osimlite.io.document.reader import read_text
from osimlite.mechanics.multibody import Mechanism, build_mechanism
from osimlite.schema import constraint_types as kinds
from osimlite.schema.forces import Force
from osimlite.schema.function_types import Sine
from osimlite.simulation import Simulation, simulate
from osimlite.simulation.elements import Forces
from osimlite.simulation.engines.protocol import EngineSettings
from tests.mechanics.multibody.strategies import KINDS, Case, cases, constraint_of

pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")

from osimlite.simulation.engines.bullet.engine import BulletEngine
from tests.simulation.support import MODELS, constrain, four_bars, half_locked, knee, patella, pins
from tests.suite import choose


def accelerations(mechanism: Mechanism, q: Any, u: Any, t: float = 0.0, route: str = "auto") -> Any:
    with BulletEngine(mechanism, Forces(()), route=route) as engine:
        return np.array(engine.compute_accelerations(t, q, u))


# ------------------------------------------------------------------------------------ random trees and constraints
@settings(max_examples=choose(20, 60))
@given(
    cases(max_bodies=4),
    st.sampled_from([*KINDS, "none"]),
    st.integers(0, 2**32 - 1),
    st.integers(0, 3),
)
def test_bullet_and_our_recursion_agree_on_any_mechanism(
    case: Case, kind: str, seed: int, locks: int
):
    assume(len(case.q))
    rng = np.random.default_rng(seed)
    held = () if kind == "none" else (constraint_of(kind, case.mechanism, rng),)
    infos = [
        replace(info, default_value=float(x))
        for info, x in zip(case.mechanism.coordinates, case.q, strict=True)
    ]
    for place in rng.integers(0, len(infos), locks):
        infos[place] = replace(infos[place], locked=True)
    mechanism = replace(case.mechanism, coordinates=tuple(infos), constraints=held)
    try:
        u = mechanism.project_speeds(case.q, case.u, 0.7)
        expected = mechanism.acceleration(case.q, u, time=0.7)
    except SimulationError:
        return
    # If no speeds fulfil the constraints, accelerations need not either.
    rows = [item.velocity_equations(mechanism.at(case.q, u, 0.7)) for item in mechanism.constraints]
    if any(np.abs(matrix @ u - wanted).max(initial=0.0) > 1e-9 for matrix, wanted in rows):
        return
    # Nearly contradictory constraints make any result uncertain.
    scale = max(1.0, float(np.abs(expected).max()), float(np.abs(u).max()) ** 2)
    assume(scale < 1e5)
    result = accelerations(mechanism, case.q, u, 0.7)
    assert np.abs(result - expected).max() < 1e-9 * scale


@pytest.mark.parametrize("opensim_derivatives", [False, True])
def test_the_derivatives_of_opensim_are_those_of_our_recursion(opensim_derivatives: bool):
    mechanism = knee(opensim_derivatives=opensim_derivatives)
    q, u = np.array((0.4, -0.3, 0.2, 0.5)), np.array((2.0, -1.0, 1.5, 0.7))
    expected = mechanism.acceleration(q, u)
    assert accelerations(mechanism, q, u) == pytest.approx(expected, rel=1e-11)
    other = knee(opensim_derivatives=not opensim_derivatives).acceleration(q, u)
    assert np.abs(other - expected).max() > 0.01


@pytest.mark.parametrize(
    "moments",
    [(0.2, 0.01, 0.04), (-0.02, 0.01, 0.04), (-0.003, -0.002, 0.001), (-0.001, -0.002, -0.003)],
)
def test_an_inertia_that_bullet_refuses_takes_no_other_route(
    moments: tuple[float, float, float], capfd: pytest.CaptureFixture[str]
):
    mechanism = knee(opensim_derivatives=False, inertia=np.diag(moments))
    q, u = np.array((0.4, -0.3, 0.2, 0.5)), np.array((2.0, -1.0, 1.5, 0.7))
    with BulletEngine(mechanism, Forces(())) as engine:
        assert engine.world.impossible
        assert engine.route == "mass-matrix"
        assert engine.compute_accelerations(0.0, q.tolist(), u.tolist()) == pytest.approx(
            mechanism.acceleration(q, u).tolist(), rel=1e-10
        )
    # Bullet prints a warning where it replaces an inertia by zero.
    assert capfd.readouterr() == ("", "")


def test_routes_that_are_none_are_refused():
    mechanism = knee(opensim_derivatives=False)
    with pytest.raises(
        UnsupportedError, match=r"articulated-body needs a model .* use mass-matrix for 'knee'"
    ):
        accelerations(mechanism, np.zeros(4), np.zeros(4), route="articulated-body")


# ------------------------------------------------------------------------------------------------ complete models


@pytest.mark.parametrize("make", MODELS.values(), ids=MODELS)
def test_energy_is_kept_and_so_are_the_constraints(make: Any):
    model = make()
    with Simulation(model) as simulation:
        names = [info.name for info in simulation.mechanism.coordinates if not info.locked]
        last = names[-1] if make is half_locked else names[0]
        trajectory = simulation.run(
            1.0, accuracy=1e-9, initial_speeds={last: 2.0}, report_interval=0.05
        )
        mechanism = simulation.mechanism
    assert trajectory.summary["constraints"]
    energy = trajectory.energy["total"]
    assert np.abs(energy - energy[0]).max() < 3e-8 * trajectory.energy["kinetic"].max()
    assert np.ptp(trajectory.values, axis=0).max() > 0.3
    for q, u in zip(trajectory.values, trajectory.speeds, strict=True):
        state = mechanism.at(q, u)
        for item in mechanism.constraints:
            assert np.abs(item.position_errors(state)).max(initial=0.0) < 1e-9
            rows, wanted = item.velocity_equations(state)
            assert np.abs(rows @ u - wanted).max() < 1e-9
    for index, info in enumerate(mechanism.coordinates):
        assert not info.locked or np.ptp(trajectory.values[:, index]) < 1e-9


@pytest.mark.parametrize("make", MODELS.values(), ids=MODELS)
def test_fixed_steps_converge_at_first_order(make: Any):
    with Simulation(make()) as simulation:
        exact = simulation.run(0.3, accuracy=1e-9).values[-1]
        errors = [
            np.abs(simulation.run(0.3, fixed_step=h).values[-1] - exact).max()
            for h in (2e-3, 1e-3, 5e-4)
        ]
    assert errors[0] < 0.02
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize("make", MODELS.values(), ids=MODELS)
def test_both_engines_take_the_same_motion(make: Any):
    ends = [
        simulate(make(), 0.3, engine, accuracy=1e-8).values[-1] for engine in ("bullet", "compiled")
    ]
    assert ends[0] == pytest.approx(ends[1], abs=1e-8)


def test_a_prescribed_coordinate_does_what_it_is_told():
    model, _ = pins(2)
    first = next(iter(model.components(Coordinate)))
    first.prescribed, first.prescribed_function = True, Sine(amplitude=0.5, omega=3.0, offset=0.2)
    trajectory = simulate(model, 1.0, accuracy=1e-8, report_interval=0.1)
    assert trajectory.values[:, 0] == pytest.approx(
        0.2 + 0.5 * np.sin(3.0 * trajectory.times), abs=1e-8
    )
    assert trajectory.speeds[:, 0] == pytest.approx(1.5 * np.cos(3.0 * trajectory.times), abs=1e-8)
    assert np.ptp(trajectory.values[:, 1]) > 0.3
    with pytest.raises(SimulationError, match="'p0' is prescribed"):
        simulate(model, 0.1, initial={"p0": 0.1})


@pytest.mark.parametrize("slope", [0.0, 0.2])
def test_a_ball_rolls_down_a_slope_as_it_should(slope: float):
    """OpenSim's rolling constraint prevents slip along X and Z of the surface; its normal is Y."""
    radius, mass, moment = 0.3, 2.0, 0.06
    model = Model(name="ball", gravity=(9.81 * math.sin(slope), -9.81 * math.cos(slope), 0.0))
    body = model.add(Body(name="ball", mass=mass, inertia=(moment, moment, moment, 0, 0, 0)))
    joint = osimlite.FreeJoint(name="free")
    for name, coordinate in zip(
        ("rx", "ry", "rz", "tx", "ty", "tz"), joint.coordinates, strict=True
    ):
        coordinate.name = name
    joint.coordinates[4].default_value = radius
    model.add(joint.between(model.ground, body))
    roll = kinds.RollingOnSurfaceConstraint(
        name="roll", socket_rolling_body=body, socket_surface_body=model.ground, surface_normal=(0, 1, 0),
        surface_height=radius,
    )  # fmt: skip
    constrain(model, roll)
    trajectory = simulate(model, 1.0, rolling=True, accuracy=1e-8, initial_speeds={"tx": 0.5})
    end = dict(zip(trajectory.coordinates, trajectory.values[-1], strict=True))
    a = 9.81 * math.sin(slope) / (1.0 + moment / (mass * radius**2))
    assert end["tx"] == pytest.approx(0.5 + 0.5 * a, abs=1e-7)
    assert end["rz"] == pytest.approx(-end["tx"] / radius, abs=1e-6)
    assert end["ty"] == pytest.approx(radius, abs=1e-8)
    # As in OpenSim, the constraint has no effect unless it is enforced.
    assert simulate(model, 0.1).summary["constraints"] == []


# ----------------------------------------------------------------------------------------------- initial states
def test_what_is_set_stays_and_the_rest_follows():
    trajectory = simulate(four_bars(), 0.01, initial={"p1": -0.5}, initial_speeds={"p2": 1.5})
    assert trajectory.values[0, 1] == -0.5
    assert trajectory.speeds[0, 2] == 1.5
    loop = build_mechanism(four_bars()).constraints[0]
    state = build_mechanism(four_bars()).at(trajectory.values[0], trajectory.speeds[0])
    assert np.abs(loop.position_errors(state)).max() < 1e-10


def test_starts_that_contradict_the_constraints_are_refused():
    with pytest.raises(
        SimulationError,
        match="no pose of 'pins' near the requested pose fulfils /constraintset/loop",
    ):
        simulate(four_bars(), 0.01, initial={"p0": 1.5, "p1": 1.5, "p2": 1.5})
    with pytest.raises(SimulationError, match="do not allow the requested speeds of p0 and p1"):
        simulate(four_bars(), 0.01, initial_speeds={"p0": 1.0, "p1": 5.0})


def test_a_massless_body_may_hang_on_a_constraint():
    model = patella()
    cap = next(body for body in model.components(Body) if body.name == "cap")
    cap.mass, cap.inertia = 0.0, (0.0,) * 6
    heavy = simulate(patella(), 0.3, accuracy=1e-8)
    light = simulate(model, 0.3, accuracy=1e-8)
    assert np.abs(light.values[-1] - heavy.values[-1]).max() > 1e-3
    assert np.abs(light.energy["total"] - light.energy["total"][0]).max() < 1e-6
    model.constraint_set.objects[0].isEnforced = False
    with pytest.raises(SimulationError, match="'cap' moves no mass"):
        simulate(model, 0.3)


def test_settings_reach_the_summary():
    summary = simulate(patella(), 0.05, opensim_derivatives=True).summary
    assert summary["settings"]["opensim_derivatives"] is True
    assert summary["constraints"] == ["/constraintset/beta"]
    assert EngineSettings().route == "auto"


def test_the_energy_of_a_real_model_with_patellas_is_kept(corpus: Any):
    entry = next(item for item in corpus if item.id == "m0954")
    model = read_text(gzip.decompress(entry.converted.read_bytes()).decode())
    for force in model.components(Force):
        force.appliesForce = False
    speeds = {f"knee_angle_{side}": 3.0 for side in "rl"}
    energies = []
    for opensim_derivatives in (False, True):
        trajectory = simulate(
            model,
            0.2,
            accuracy=1e-9,
            initial_speeds=speeds,
            opensim_derivatives=opensim_derivatives,
        )
        energies.append(np.ptp(trajectory.energy["total"]) / trajectory.energy["kinetic"].max())
    assert energies[0] < 1e-8
    assert energies[1] > 1e-6
