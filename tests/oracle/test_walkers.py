"""Simulate the shipped walkers in OpenSim 4.6 and compare their walks with osimlite's.

Foot strikes are counted from OpenSim's own contact forces. A step is a touch-down of the other
foot, at least 5 cm ahead along the slope and after at least 0.05 s in the air. Any other touch-down
is a scuff. The walk ends when a hip or a knee touches the slope.
"""

from __future__ import annotations

import os

import pytest

import osimlite
from osimlite.simulation import Simulation

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
from benchmarks._opensim_walks import WalkRequest, simulate_opensim_walks
from osimlite.studies.gait.steps import walk_many
from tests.suite import choose

pytestmark = [pytest.mark.oracle, pytest.mark.timeout(900)]

MINUTE = 60.0 if "OSIMLITE_ALL_MODELS" in os.environ else choose(4.0, 12.0)
"""Duration of a walk (s); OSIMLITE_ALL_MODELS=1 walks a minute, which takes OpenSim half a minute."""
# Simulated time (s) of each walker.
LONG = {"steady-walker": MINUTE, "human-walker": MINUTE, "furthest-walker": 5.0}
ACCURACY = {"steady-walker": 1e-8, "human-walker": 1e-6, "furthest-walker": 1e-8}
"""Accuracy of the integrators; at a finer one OpenSim is slow for the human walker's stiff knee stops."""


@pytest.fixture(scope="module")
def walks(fixtures):
    """Return OpenSim's walk and osimlite's from the same file, by the name of the walker."""
    requests = {
        name: WalkRequest(fixtures / "walkers" / f"{name}.osim", LONG[name], accuracy)
        for name, accuracy in ACCURACY.items()
    }
    theirs = simulate_opensim_walks(requests)
    result = {}
    for name, request in requests.items():
        with Simulation(osimlite.read(request.path), "compiled") as simulation:
            start = simulation.initial_state({}, {})
            (ours,) = walk_many(simulation.engine, [start], request.to, accuracy=request.accuracy)
        result[name] = theirs[name][0], ours
    return result


@pytest.mark.parametrize("name", ["steady-walker", "human-walker"])
@pytest.mark.full
def test_it_walks_on(walks, name):
    theirs, _ = walks[name]
    assert theirs.walks and theirs.end == MINUTE and theirs.scuffs == []
    assert len(theirs.steps) >= MINUTE * 50 / 60
    assert [step.foot for step in theirs.steps[:3]] in ([0, 1, 0], [1, 0, 1])


def test_the_exercise_makes_four_steps(walks):
    theirs, _ = walks["furthest-walker"]
    assert (theirs.ending, theirs.fell_on) == ("fell", "RKneeForce")
    assert [step.foot for step in theirs.steps] == [1, 0, 1, 0] and theirs.scuffs == []


@pytest.mark.parametrize("name", list(LONG))
def test_ours_is_the_same_walk(walks, name):
    """Steps have the same times, except for the time between the moments that OpenSim reports."""
    theirs, ours = walks[name]
    assert (theirs.ending, theirs.fell_on, len(theirs.scuffs)) == (
        ours.ending,
        ours.fell_on,
        len(ours.scuffs),
    )
    assert theirs.end == pytest.approx(ours.end, abs=1e-3)
    assert [step.foot for step in theirs.steps] == [step.foot for step in ours.steps]
    for field in ("time", "air", "length"):
        result = [getattr(step, field) for step in theirs.steps]
        assert result == pytest.approx([getattr(step, field) for step in ours.steps], abs=1e-3), (
            field
        )
    # The walk ends in the middle of a step, whose integration error is not yet part of its strikes.
    allowed = max(1e-5, 30.0 * ACCURACY[name])
    assert theirs.distance == pytest.approx(ours.distance, rel=5e-6, abs=allowed)
