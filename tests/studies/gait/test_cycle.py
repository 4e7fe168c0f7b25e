"""Tests of the step map, its fixed points and their multipliers, on built-in walkers."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from osimlite.cli import create_app
from osimlite.errors import OsimliteError
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.models.walkers import human_walker, steady_walker
from osimlite.simulation import Simulation
from osimlite.studies.gait.basin import find_basin, sample_perturbed_starts, simulate_walks
from osimlite.studies.gait.cycle import differentiate_step_map, find_cycle
from osimlite.studies.gait.stepmap import StepMap
from osimlite.studies.gait.steps import measure_along_slope, walk_many


@pytest.fixture(scope="module")
def steady():
    with Simulation(steady_walker(), "compiled") as simulation:
        start = np.array(simulation.initial_state({}, {}))
        step_map = StepMap(simulation.engine, start)
        yield SimpleNamespace(
            engine=simulation.engine,
            start=start,
            step_map=step_map,
            cycle=find_cycle(step_map),
            names=names(simulation),
        )


def names(simulation) -> list[str]:
    infos = simulation.mechanism.coordinates
    return [infos[place].name for place in simulation.engine.order]


def test_the_steady_walker_walks_in_a_stable_cycle(steady):
    cycle = steady.cycle
    assert cycle.residual < 1e-9 and cycle.scuffs == 0 and not cycle.per_stride
    assert (cycle.length, cycle.period) == pytest.approx((0.624382, 0.816599), abs=2e-6)
    # Feet roll while they stand, so a walker advances by more than the distance between its feet.
    (walk,) = walk_many(steady.engine, steady.start[None], 20.0, accuracy=1e-8)
    first, *_, last = walk.steps
    x = steady.names.index("Pelvis_tx")
    assert cycle.speed == pytest.approx(
        (last.state[x] - first.state[x]) / (last.time - first.time), rel=1e-4
    )
    assert cycle.largest == pytest.approx(0.5659, abs=2e-3) and cycle.largest < 0.6
    assert len(cycle.multipliers) == 11 and cycle.neutral == 3
    # The section has no extent along the motion, so one multiplier is zero.
    assert np.abs(cycle.multipliers).min() < 1e-4


def test_a_walker_comes_back_as_the_derivative_says(steady):
    """Near the cycle the map is linear, and the eigenvalues of its derivative are the multipliers."""
    step_map, cycle = steady.step_map, steady.cycle
    slope = differentiate_step_map(step_map, cycle.state)
    assert np.sort(np.abs(np.linalg.eigvals(slope))) == pytest.approx(
        np.sort(np.abs(cycle.multipliers))
    )
    away = np.random.default_rng(1).normal(0.0, 3e-6, 11)
    y, expected = (cycle.state + step_map.basis @ away)[None], away
    for _ in range(8):
        y, expected = step_map(y).states, slope @ expected
        result = step_map.reduce(y[0]) - step_map.reduce(cycle.state)
        # The perturbation grows a hundredfold before it decays, and may pass near zero on the way.
        assert np.linalg.norm(result - expected) < 0.01 * np.linalg.norm(
            expected
        ) + 0.1 * np.linalg.norm(away)


def test_neutral_directions_are_the_slope_and_the_turn_of_the_pelvis(steady):
    n = len(steady.names)
    place = steady.names.index
    along, turned, spun = (np.zeros(2 * n) for _ in range(3))
    tilt = np.pi / 2 - 1.57
    along[[place("Pelvis_tx"), place("Pelvis_ty")]] = np.cos(tilt), np.sin(tilt)
    for row, first in ((turned, 0), (spun, n)):
        row[[first + place("Pelvis_rz"), first + place("RHip_rz"), first + place("LHip_rz")]] = (
            1.0,
            -1.0,
            -1.0,
        )
    neutral = steady.step_map.neutral
    for direction in (along, turned, spun):
        inside = neutral @ (neutral.T @ direction)
        assert inside == pytest.approx(direction, abs=1e-5)


def test_moving_down_the_slope_moves_the_image(steady):
    step_map, y = steady.step_map, steady.cycle.state
    moved = y + 0.3 * step_map.neutral[:, 0]
    one, other = step_map([y, moved]).states
    assert step_map.reduce(other) == pytest.approx(step_map.reduce(one), abs=1e-6)


def test_the_section_is_a_heel_strike(steady):
    image = step_map_image(steady)
    _, depths = measure_along_slope(steady.engine, image[None])
    assert depths[0, steady.engine.contacts.index("RFootForce")] == pytest.approx(0.0, abs=1e-12)


def step_map_image(steady):
    return steady.step_map(steady.cycle.state[None]).states[0]


def test_a_varied_map_is_that_of_the_other_model(steady):
    """The basis of its reduced states is nearly that of the original map, while a new map may have a rotated basis."""
    with Simulation(steady_walker(foot_ahead=0.073), "compiled") as simulation:
        new = StepMap(simulation.engine, simulation.initial_state({}, {}))
        varied = steady.step_map.rebuild_for_model(
            simulation.engine, simulation.initial_state({}, {})
        )
        here = steady.cycle.state[None]
        assert np.array_equal(varied(here).states, new(here).states)
    assert np.abs(varied.basis - steady.step_map.basis).max() < 1e-2
    assert varied.basis.T @ varied.basis == pytest.approx(np.eye(11), abs=1e-12)
    assert varied.neutral @ varied.neutral.T == pytest.approx(new.neutral @ new.neutral.T, abs=1e-9)


def test_perturbed_starts_stand_as_deep_as_before(steady):
    starts = sample_perturbed_starts(steady.step_map, steady.start, 0.05, 8, 3)
    assert np.array_equal(
        starts, sample_perturbed_starts(steady.step_map, steady.start, 0.05, 8, 3)
    )
    place = steady.engine.contacts.index("RFootForce")
    before, after = (
        measure_along_slope(steady.engine, np.atleast_2d(rows))[1][:, place]
        for rows in (steady.start, starts)
    )
    assert after == pytest.approx(np.full(8, before[0]), abs=1e-9)
    assert len(simulate_walks(steady.step_map, steady.cycle, starts, 3)) == 8


def test_a_basin_has_the_cycle_in_its_middle(steady):
    basin = find_basin(
        steady.step_map,
        steady.cycle,
        "RHip_rz/speed",
        "LHip_rz",
        reach=0.02,
        grid=3,
        target_steps=5,
    )
    assert basin.steps.shape == (3, 3) and basin.steps[1, 1] == 5
    assert basin.x.label == "speed of RHip_rz (rad/s)" and basin.y.label == "LHip_rz (rad)"
    assert basin.center == pytest.approx((basin.x.values[1], basin.y.values[1]))
    with pytest.raises(OsimliteError, match="locked"):
        find_basin(steady.step_map, steady.cycle, "platform_rz", grid=3)
    other = find_basin(
        steady.step_map, steady.cycle, y="RHip_rz/speed", reach=0.02, grid=2, target_steps=2
    )
    assert (other.x.label, other.y.label) == (
        "speed of LHip_rz (rad/s)",
        "speed of RHip_rz (rad/s)",
    )


def test_the_human_walker_walks_from_two_digits():
    model = human_walker()
    with Simulation(model, "compiled") as simulation:
        start = simulation.initial_state({}, {})
        assert all(float(f"{value:.2g}") == value for value in start)
        (walk,) = walk_many(simulation.engine, [start], 60.0, accuracy=1e-6)
        assert walk.walks and len(walk.steps) >= 50 and not walk.scuffs
        cycle = find_cycle(StepMap(simulation.engine, walk.steps[-1].state))
        assert cycle.residual < 1e-9 and cycle.largest == pytest.approx(0.5529, abs=2e-3)


def test_the_steady_walker_differs_in_two_properties():
    """Besides the inertia of shanks and the position of feet, only start, platform length and name differ."""
    theirs, ours = (
        {part.path: part for part in model.components()}
        for model in (dynamic_walker(), steady_walker())
    )
    assert theirs.keys() == ours.keys()
    start = {"default_value", "default_speed_value", "range", "half_lengths", "name"}
    changed = set()
    for path, part in theirs.items():
        for spec in type(part).field_specs().values():
            one, other = getattr(part, spec.name), getattr(ours[path], spec.name)
            if spec.name not in start and isinstance(one, tuple | float) and one != other:
                changed.add((path, spec.name))
    assert changed == {
        *((f"/bodyset/{side}Shank", "inertia") for side in ("Right", "Left")),
        *((f"/contactgeometryset/{side}FootContact", "location") for side in "RL"),
    }


def test_who_makes_no_step_has_no_map():
    with (
        Simulation(dynamic_walker(), "compiled") as simulation,
        pytest.raises(OsimliteError, match="makes no step"),
    ):
        StepMap(simulation.engine, simulation.initial_state({}, {}))


def test_the_command(tmp_path, monkeypatch):
    # Paths are never wrapped: a long folder would make long lines.
    monkeypatch.chdir(tmp_path)
    words = "gait steady-walker --to 5 --perturb 0.05 --starts 4 --steps 3 --basin --grid 2 --reach 0.01 --no-pictures"
    done = CliRunner().invoke(create_app(["gait"]), [*words.split(), "-o", "."])
    assert done.exit_code == 0, done.output
    assert (
        "6 steps, 0 scuffs" in done.output
        and "stable: largest Floquet multiplier 0.56" in done.output
    )
    assert max(len(line) for line in done.output.splitlines()) <= 80
    facts = json.loads((tmp_path / "gait.json").read_text())
    assert facts["cycle"]["step_length_m"] == pytest.approx(0.624382, abs=1e-6)
    assert len((tmp_path / "basin.csv").read_text().splitlines()) == 5
    (tmp_path / "basin.png").write_bytes(b"of an earlier walk")
    done = CliRunner().invoke(
        create_app(["gait"]), ["gait", "steady-walker", "--to", "5", "-o", str(tmp_path)]
    )
    assert done.exit_code == 0 and [each.name for each in tmp_path.iterdir()] == ["gait.json"]
    done = CliRunner().invoke(create_app(["gait"]), ["gait", "dynamic-walker"])
    assert (
        done.exit_code == 1 and "0 steps, 1 scuff" in done.output and "makes no step" in done.output
    )
