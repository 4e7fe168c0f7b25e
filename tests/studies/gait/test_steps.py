"""Tests of the detection of steps, scuffs and falls, on motions with known contacts."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.errors import OsimliteError
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.contact import ContactGeometry
from osimlite.schema.forces import HuntCrossleyForce
from osimlite.simulation import Simulation
from osimlite.simulation.cached_simulation import simulate
from osimlite.studies.gait import steps
from osimlite.studies.gait.foot_contacts import FootContacts, find_footing
from osimlite.studies.gait.steps import WalkerSteps, measure_along_slope, walk_many

FEET = (("RFootForce",), ("LFootForce",))


@pytest.fixture(scope="module")
def engine():
    with Simulation(dynamic_walker(), "compiled") as simulation:
        yield simulation.engine


def start_of(engine) -> np.ndarray:
    infos = engine.mechanism.coordinates
    return np.array(
        engine.state.pack([i.default_value for i in infos], [i.default_speed for i in infos])
    )


def test_feet_are_found_by_structure(engine):
    assert find_footing(engine) == FootContacts(
        FEET, ("RHipForce", "LHipForce", "RKneeForce", "LKneeForce")
    )


def test_names_decide_nothing_where_the_structure_does():
    model = dynamic_walker()
    for force in model.components(HuntCrossleyForce):
        force.name = {"RFootForce": "one", "RKneeForce": "my toe"}.get(force.name, force.name)
    with Simulation(model, "compiled") as simulation:
        assert find_footing(simulation.engine).feet == (("one",), ("LFootForce",))


def test_feet_may_be_given(engine):
    footing = find_footing(engine, ["RFootForce + RKneeForce", "LFootForce"])
    assert footing == FootContacts(
        (("RFootForce", "RKneeForce"), ("LFootForce",)), ("RHipForce", "LHipForce", "LKneeForce")
    )
    with pytest.raises(OsimliteError, match="'RFotForce'; did you mean 'RFootForce'"):
        find_footing(engine, ["RFotForce", "LFootForce"])
    with pytest.raises(OsimliteError, match="has no contact force 'foo'; expected RHipForce"):
        find_footing(engine, ["foo", "LFootForce"])
    with pytest.raises(OsimliteError, match="two feet"):
        find_footing(engine, ["RFootForce"])
    for feet in (["RFootForce", "RFootForce"], ["RFootForce", "LFootForce + RFootForce"]):
        with pytest.raises(OsimliteError, match="'RFootForce' is named for both feet"):
            find_footing(engine, feet)


def test_a_model_without_legs_says_so():
    model = dynamic_walker()
    for force in list(model.components(HuntCrossleyForce)):
        force.appliesForce = force.name in ("RHipForce", "LHipForce")
    with (
        Simulation(model, "compiled") as simulation,
        pytest.raises(OsimliteError, match=r"of 1 leg .*--foot"),
    ):
        find_footing(simulation.engine)


def test_the_exercise_falls_on_its_knee_without_a_step(engine):
    (walk,) = walk_many(engine, start_of(engine)[None], 2.0)
    summary = simulate(dynamic_walker(), 1.0, "compiled").summary["contact_events"]
    first = next(event for event in summary if event["contact"] in ("LKneeForce", "RKneeForce"))
    assert (walk.ending, walk.fell_on) == ("fell", first["contact"])
    assert walk.end == pytest.approx(first["time_s"], abs=2e-3)
    assert walk.steps == [] and len(walk.scuffs) == 1 and walk.distance == 0.0


def test_places_along_the_slope(engine):
    """Moving the pelvis along the platform moves all spheres alike, apart from the angle of the plane."""
    one = start_of(engine)
    other = one.copy()
    place = engine.order.index(engine.mechanism.coordinate_index("Pelvis_tx"))
    other[place] += 0.25
    along, depth = measure_along_slope(engine, np.array([one, other]))
    angle = np.pi / 2 - 1.57  # angle between the exercise's plane and the platform
    assert along[1] - along[0] == pytest.approx(np.full(6, 0.25 * np.cos(angle)), abs=1e-12)
    assert depth[1] - depth[0] == pytest.approx(np.full(6, 0.25 * np.sin(angle)), abs=1e-12)
    plane = next(
        g for g in dynamic_walker().components(ContactGeometry) if g.name == "PlatformContact"
    )
    ty = one[engine.order.index(engine.mechanism.coordinate_index("Pelvis_ty"))]
    hip = 0.05 - (ty - plane.location[1]) * np.cos(angle)
    assert depth[0, :2] == pytest.approx([hip, hip], abs=1e-12)


def follow(events, along, touching=(False, False)) -> WalkerSteps:
    contacts = ["RFootForce", "LFootForce", "RHipForce"]
    states = np.arange(len(events), dtype=float)[:, None]
    return steps.follow_events(
        FootContacts(FEET, ("RHipForce",)),
        contacts,
        events,
        states,
        np.array(along),
        np.array((*touching, False)),
    )


def test_what_is_a_step():
    right, left = "RFootForce", "LFootForce"
    walk = follow(
        [
            (0.0, left, False),
            (0.5, left, True),  # a step of 0.3 m
            (0.6, right, False),
            (0.62, right, True),  # too early
            (0.63, right, False),
            (0.9, right, True),  # not far enough ahead
            (0.91, right, False),
            (1.2, right, True),  # a step of 0.4 m
            (1.25, left, False),
            (1.26, right, False),
            (1.4, right, True),  # the same foot again
            (1.5, "fall: RHipForce", True),
            (1.6, left, True),
        ],
        [[0.0, 0.0, 0]]
        + [[0.0, 0.3, 0]] * 4
        + [[0.34, 0.3, 0]] * 2
        + [[0.7, 0.3, 0]] * 3
        + [[0.9, 0.3, 0]] * 3,
        touching=(True, True),
    )
    assert [(s.time, s.foot) for s in walk.steps] == [(0.5, 1), (1.2, 0)]
    assert [s.length for s in walk.steps] == pytest.approx([0.3, 0.4])
    assert [s.air for s in walk.steps] == pytest.approx([0.5, 0.29])
    assert [s.state[0] for s in walk.steps] == [1.0, 7.0]
    assert [(s.time, s.foot) for s in walk.scuffs] == [(0.62, 0), (0.9, 0), (1.4, 0)]
    assert (walk.end, walk.ending, walk.fell_on, walk.clean_steps) == (1.5, "fell", "RHipForce", 1)
    assert walk.distance == pytest.approx(0.4)


def test_a_heel_and_a_toe_are_one_foot():
    events = [
        (0.1, "heel", True),
        (0.2, "toe", True),
        (0.5, "heel", False),
        (0.6, "toe", False),
        (0.9, "heel", True),
    ]
    footing = FootContacts((("heel", "toe"), ("other",)), ())
    walk = steps.follow_events(
        footing,
        ["heel", "toe", "other"],
        events,
        np.zeros((5, 1)),
        np.array([[0.3, 0.5, 0.0]] * 4 + [[0.8, 0.9, 0.0]]),
        np.array([False, False, True]),
    )
    assert [(s.time, s.foot) for s in walk.steps] == [(0.1, 0)]
    assert [(s.time, s.air) for s in walk.scuffs] == [(0.9, pytest.approx(0.3))]


def test_walks_do_not_depend_on_their_neighbours(engine):
    rng = np.random.default_rng(3)
    starts = start_of(engine) + rng.uniform(-0.3, 0.3, (20, 14))
    together = walk_many(engine, starts, 1.5, threads=2)
    for start, walk in zip(starts, together, strict=True):
        (alone,) = walk_many(engine, start[None], 1.5)
        assert (walk.end, walk.ending, len(walk.steps), walk.scuffs) == (
            alone.end,
            alone.ending,
            len(alone.steps),
            alone.scuffs,
        )
