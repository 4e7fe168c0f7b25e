from __future__ import annotations

import copy
import dataclasses
import pickle

import numpy as np
import pytest
from hypothesis import given

from osimlite.errors import ModelError, SettingError
from osimlite.mechanics.multibody.dynamics import Wrench
from osimlite.mechanics.multibody.mechanism import FramePlacement, Mechanism
from osimlite.mechanics.multibody.spatial import make_offset
from tests.mechanics.multibody.cases import mixed_tree
from tests.mechanics.multibody.strategies import Case, cases


def test_values_come_as_arrays_or_by_name():
    tree = mixed_tree()
    by_name = tree.values({"b2": 0.3, "/jointset/jA/a1": -1.0})
    assert by_name[tree.coordinate_index("b2")] == 0.3
    assert by_name[0] == -1.0
    assert np.count_nonzero(by_name) == 2
    by_order = tree.body_transforms(by_name)["W"]
    assert (tree.body_transforms({"b2": 0.3, "a1": -1.0})["W"] == by_order).all()


def test_names_left_out_take_their_default():
    tree = mixed_tree()
    changed = [
        dataclasses.replace(info, default_value=0.2, default_speed=0.4) for info in tree.coordinates
    ]
    tree = Mechanism(tree.name, tree.bodies, tuple(changed))
    assert tree.values({"c1": 1.0})[:9] == pytest.approx([0.2] * 9)
    assert tree.speeds({})[0] == 0.4
    q, u = tree.default_state()
    assert (set(q), set(u)) == ({0.2}, {0.4})
    assert tree.acceleration(q, u, {"b1": 1.0}) == pytest.approx(
        tree.acceleration(q, u, np.eye(24)[tree.coordinate_index("b1")])
    )


def test_two_coordinates_with_one_name_are_told_apart_by_their_paths():
    tree = mixed_tree()
    twice = (*tree.coordinates[:-1], dataclasses.replace(tree.coordinates[-1], name="a1"))
    tree = Mechanism(tree.name, tree.bodies, twice)
    assert tree.coordinate_index(twice[0].path) == 0
    assert tree.coordinate_index(twice[-1].path) == len(twice) - 1
    assert tree.coordinate_names[0] == twice[0].path and tree.coordinate_names[1] == twice[1].name
    with pytest.raises(ModelError, match="several coordinates 'a1'"):
        tree.coordinate_index("a1")


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda tree: tree.body_transforms({"bb2": 0.0}),
            "has no coordinate 'bb2'; did you mean 'b2'",
        ),
        (
            lambda tree: tree.mass_matrix([1.0, 2.0]),
            r"one value for each of its coordinates \(24\).*got 2",
        ),
        (lambda tree: tree.mass_matrix(0.0), "got a single one"),
        (lambda tree: tree.bias(np.zeros(24), np.zeros((24, 1))), "one speed.*got 24 × 1"),
        (
            lambda tree: tree.frame_transform("/bodyset/w", {}),
            "no body or frame '/bodyset/w'; did you mean '/bodyset/W",
        ),
        (
            lambda tree: tree.acceleration(
                {}, {}, body_wrenches={"Q": Wrench((0, 0, 0), (0, 0, 0))}
            ),
            "frame 'Q'",
        ),
        (lambda tree: tree.jacobian("W", {}, (0.0, 1.0)), "a station has 3 numbers; got 2"),
        (
            lambda tree: tree.station_position("W", 0.0, {}),
            "a station has 3 numbers; got a single one",
        ),
        (
            lambda tree: tree.generalized_forces({}, {"W": ((1, 2), (0, 0, 0))}),
            "a force has 3 numbers; got 2",
        ),
        (
            lambda tree: tree.generalized_forces({}, {"W": ((0, 0, 0), [[1, 2, 3]])}),
            "a torque has 3 numbers; got 1 × 3",
        ),
    ],
)
def test_what_is_not_there_is_named(call, words):
    with pytest.raises(ModelError, match=words):
        call(mixed_tree())


def test_values_that_are_no_numbers_are_refused():
    tree = mixed_tree()
    for value in ("x", None, [1.0, 2.0]):
        with pytest.raises(
            SettingError, match="coordinate 'b2' takes one number as its value, not"
        ):
            tree.mass_matrix({"b2": value})
    with pytest.raises(
        SettingError, match=r"takes one value for each of its coordinates .* numbers"
    ):
        tree.mass_matrix(["x"] * len(tree.coordinates))


def test_bodies_must_follow_their_carriers():
    tree = mixed_tree()
    with pytest.raises(
        ModelError, match=f"'{tree.bodies[-1].name}' stands before the body that carries it"
    ):
        Mechanism("wrong", tree.bodies[::-1], tree.coordinates)
    with pytest.raises(ModelError, match="do not share out its coordinates"):
        Mechanism("wrong", tree.bodies, tree.coordinates[:-1])


def test_a_mechanism_without_coordinates_still_answers():
    empty = Mechanism("nothing", (), ())
    assert empty.body_transforms([]) == {}
    assert empty.total_mass == 0.0
    assert empty.center_of_mass({}) == pytest.approx(np.zeros(3))
    assert empty.acceleration([], []).shape == (0,)
    assert empty.mass_matrix([]).shape == (0, 0)
    assert empty.kinetic_energy([], []) == 0.0


def _with_frame(mechanism: Mechanism) -> tuple[Mechanism, FramePlacement]:
    placed = FramePlacement(
        len(mechanism.bodies) - 1, make_offset((0.1, -0.2, 0.3), (0.4, 0.5, -0.6))
    )
    frames = {"/bodyset/last/frame": placed, "/ground/corner": FramePlacement(-1, placed.transform)}
    return dataclasses.replace(mechanism, frames=frames), placed


@given(cases())
def test_stations_follow_their_frames(case: Case):
    mechanism, placed = _with_frame(case.mechanism)
    q, u, station, name = case.q, case.u, np.array((0.2, 0.3, -0.1)), "/bodyset/last/frame"
    frame = mechanism.frame_transform(name, q)
    body = mechanism.body_transforms(q)[mechanism.bodies[-1].name]
    assert frame == pytest.approx(body @ placed.transform, abs=1e-14)
    position = mechanism.station_position(name, station, q)
    assert position == pytest.approx(frame[:3, :3] @ station + frame[:3, 3], abs=1e-13)
    velocity = mechanism.station_velocity(name, station, q, u)
    w = mechanism.body_velocities(q, u)[mechanism.bodies[-1].name][:3]
    assert mechanism.jacobian(name, q, station) @ u == pytest.approx(
        np.concatenate((w, velocity)), abs=1e-11
    )
    rates, step = mechanism.rate_matrix(q) @ u, 1e-6
    ahead, behind = (
        mechanism.station_position(name, station, q + t * rates) for t in (step, -step)
    )
    assert velocity == pytest.approx((ahead - behind) / (2 * step), abs=1e-6)


def test_ground_stands_still():
    tree, placed = _with_frame(mixed_tree())
    q, u = tree.values({}), np.ones(24)
    assert tree.frame_transform("ground", q) == pytest.approx(np.eye(4))
    assert tree.frame_transform("/ground/corner", q) == pytest.approx(placed.transform)
    assert tree.station_velocity("/ground/corner", (1.0, 2.0, 3.0), q, u) == pytest.approx(
        np.zeros(3)
    )
    assert not tree.jacobian("ground", q).any()
    assert not tree.generalized_forces(
        q, {"ground": Wrench((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))}
    ).any()


@given(cases())
def test_a_wrench_at_a_frame_is_that_of_its_body_moved(case: Case):
    mechanism, _ = _with_frame(case.mechanism)
    q, name = case.q, mechanism.bodies[-1].name
    force, torque = np.array((3.0, -4.0, 5.0)), np.array((0.5, 0.2, -0.3))
    arm = (
        mechanism.frame_transform("/bodyset/last/frame", q)[:3, 3]
        - mechanism.body_transforms(q)[name][:3, 3]
    )
    at_frame = mechanism.generalized_forces(q, {"/bodyset/last/frame": Wrench(force, torque)})
    at_body = mechanism.generalized_forces(q, {name: Wrench(force, torque + np.cross(arm, force))})
    assert at_frame == pytest.approx(at_body, abs=1e-11)


@given(cases())
def test_rates_and_speeds_convert_both_ways(case: Case):
    mechanism, q, u, _ = case
    assert mechanism.speeds_from_rates(q, mechanism.coordinate_rates(q, u)) == pytest.approx(
        u, abs=1e-10
    )


def test_a_mechanism_is_the_same_in_another_process():
    mechanism = mixed_tree()
    matrix = mechanism.mass_matrix({})
    assert np.array_equal(pickle.loads(pickle.dumps(mechanism)).mass_matrix({}), matrix)
    state = mechanism.at({}, {})
    origins = state.origins
    for other in (pickle.loads(pickle.dumps(state)), copy.deepcopy(state)):
        assert np.array_equal(other.origins, origins)


def test_a_state_stays_as_it_was_asked_for():
    mechanism = mixed_tree()
    q = mechanism.values({}).copy()
    state, expected = mechanism.at(q), mechanism.at(q).origins
    q += 0.1
    assert np.array_equal(state.origins, expected)
