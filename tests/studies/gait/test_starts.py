"""Tests of placing walkers on their feet."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.simulation import Simulation
from osimlite.studies.gait.foot_contacts import find_footing
from osimlite.studies.gait.starts import (
    find_carriers,
    lift_to_depth,
    move_along_neutral_directions,
    plant_feet,
)
from osimlite.studies.gait.steps import measure_along_slope


@pytest.fixture(scope="module")
def walker():
    with Simulation(dynamic_walker(), "compiled") as simulation:
        yield simulation.engine


@pytest.fixture
def states(walker):
    rng = np.random.default_rng(3)
    n = len(walker.order)
    return np.hstack((rng.uniform(-0.5, 0.5, (20, n)), rng.uniform(-3.0, 3.0, (20, n))))


def places_of(walker, *names: str) -> list[int]:
    infos = walker.mechanism.coordinates
    return [[infos[place].name for place in walker.order].index(name) for name in names]


def test_the_pelvis_carries_the_walker(walker):
    result = find_carriers(walker, find_footing(walker))
    forward, up = places_of(walker, "Pelvis_tx", "Pelvis_ty")
    assert result.offsets == (forward, up) and result.lift_offset == up


@pytest.mark.parametrize("slope", [None, 2.0, 25.0])
def test_a_planted_foot_touches_and_rests(walker, states, slope):
    """The joint of the pelvis rotates with the slope, so that neutral directions differ between slopes."""
    footing, numbers, rows = find_footing(walker), None, np.arange(len(states))
    if slope is not None:
        with Simulation(dynamic_walker(slope=slope), "compiled") as simulation:
            numbers = np.tile(simulation.engine.numbers, (len(states), 1))
    placed = plant_feet(walker, footing, states, numbers=numbers)
    feet = [walker.contacts.index(foot[0]) for foot in footing.feet]
    which = None if numbers is None else rows
    depths = measure_along_slope(walker, placed, numbers, which)[1][:, feet]
    assert np.abs(depths.max(axis=1)).max() < 1e-12
    n, dt = len(walker.order), 1e-6
    later = placed.copy()
    later[:, :n] += dt * placed[:, n:]
    before, after = (walker.locate_contacts(moved, numbers, which) for moved in (placed, later))
    moved = (after - before)[:, feet, 6:]
    assert np.linalg.norm(moved[rows, depths.argmax(axis=1)], axis=1).max() < 20 * dt**2
    others = [
        k
        for k in range(2 * n)
        if k not in places_of(walker, "Pelvis_ty") and k - n not in range(1, 3)
    ]
    assert (placed[:, others] == states[:, others]).all()


def test_one_foot_is_put_as_deep_as_it_is_wanted(walker, states):
    footing = find_footing(walker)
    for foot in (0, 1):
        placed = lift_to_depth(walker, footing, states, 0.002, foot)
        depths = measure_along_slope(walker, placed)[1][
            :, walker.contacts.index(footing.feet[foot][0])
        ]
        assert depths == pytest.approx(0.002, abs=1e-12)


def test_upright_takes_away_what_does_not_matter():
    """The first entry that a neutral direction changes becomes zero; entries that none changes stay."""
    neutral = np.array([[0.0, 1.0, 0.0, 2.0], [0.0, 0.0, 3.0, -3.0]]).T
    moved = move_along_neutral_directions(np.array([[5.0, 1.0, 2.0, 3.0]]), neutral)
    assert moved == pytest.approx(np.array([[5.0, 0.0, 0.0, 3.0 - 2.0 + 2.0]]))
