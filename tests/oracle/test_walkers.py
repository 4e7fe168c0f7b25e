"""OpenSim 4.6 itself walks with the walkers that are shipped.

Foot strikes are counted from OpenSim's own contact forces: a step is the other foot touching down
at least 5 cm ahead along the slope after at least 0.05 s in the air, any other touch-down is a
scuff, and a hip or a knee on the slope ends the walk.
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
"""How long they walk; OpenSim takes half a minute for a whole one, which is asked with OSIMLITE_ALL_MODELS=1."""
LONG = {"steady-walker": MINUTE, "human-walker": MINUTE, "furthest-walker": 5.0}
ACCURACY = {"steady-walker": 1e-8, "human-walker": 1e-6, "furthest-walker": 1e-8}
"""The human walker's knees stop so hard that OpenSim takes long at a finer one."""


@pytest.fixture(scope="module")
def walks(fixtures):
    """By name, OpenSim's walk and ours, from the same file."""
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
    """Steps at the same times, to what OpenSim's integrator goes on between the moments that it reports."""
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
    # In the middle of a step, where they end, the error of the integration is not yet in its strikes.
    allowed = max(1e-5, 30.0 * ACCURACY[name])
    assert theirs.distance == pytest.approx(ours.distance, rel=5e-6, abs=allowed)
