"""Tests of `fit`: sizes and marker positions of simulated persons are recovered."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError, SettingError
from osimlite.fitting.person import fit
from osimlite.fitting.person_files import SETUP, create_person_files
from osimlite.fitting.scale_tool import compute_scaled_model
from osimlite.fitting.segments import Segments, get_opposite_name
from osimlite.fitting.shape import ScalableMarkers
from osimlite.io.document.reader import read_any
from osimlite.schema.tools.scale import ScaleTool
from tests.fitting.support import HELD, SIZES, assert_same, marked, person

FIXTURES = Path(__file__).parents[2] / "fixtures"


@pytest.mark.parametrize("seed", range(3))
def test_somebody_is_found_again(seed: int) -> None:
    """With noise of 5 mm, sizes are recovered to 1 % and displacements of markers to 3 mm."""
    data, offsets = person(seed, 0.005, 200)
    model = marked()
    text = osimlite.to_text(model)
    result = osimlite.fit(model, {"moving": data}, held=HELD)
    assert osimlite.to_text(model) == text
    for body, size in SIZES.items():
        assert result.factors[body] == pytest.approx([size] * 3, rel=0.01), body
        assert abs(result.factors[body][0] - size) < 4.0 * result.uncertain[body][0]
    assert {*result.offsets} == {*offsets}
    for name, by in offsets.items():
        assert np.linalg.norm(result.offsets[name] - by) < 0.003, name
    error = result.errors(result.after)["moving"]
    assert (
        0.007 < error < 0.005 * np.sqrt(3.0)
        and result.errors(result.before)["moving"] > 2.0 * error
    )
    motion = osimlite.inverse_kinematics(result.model, data)
    assert motion.summary["rms_marker_error"] == pytest.approx(error, rel=1e-3)


def test_two_sides_are_one_unless_asked() -> None:
    """Without markers on one shank, its size is that of the other side."""
    data, _ = person(5)
    only = {name: place for name, place in data.items() if not name.startswith("LeftShank")}
    together = fit(marked(), {"moving": only}, held=HELD)
    assert together.factors["LeftShank"] == together.factors["RightShank"]
    apart = fit(marked(), {"moving": data}, held=HELD, symmetric=False, by_axis=True)
    assert apart.factors["LeftThigh"] != apart.factors["RightThigh"]
    assert apart.factors["LeftThigh"][1] == pytest.approx(1.12, rel=0.01)
    assert len(set(apart.factors["LeftThigh"])) == 3


def test_a_marker_that_was_taken_for_another_is_left_out() -> None:
    """Swapped markers are left out in those frames, and a note names marker and trial."""
    data, _ = person(7, 0.002)
    one, two = "LeftShank_upper", "RightShank_upper"
    data[one][10:13], data[two][10:13] = data[two][10:13] + 0.3, data[one][10:13] - 0.3
    result = fit(marked(), {"walk": data}, held=HELD)
    assert {note.split(" is left out in ")[0] for note in result.notes} == {one, two}
    assert all("in 3 frames of walk" in note for note in result.notes)
    assert np.isnan(result.measured[10:13, result.markers.index(one)]).all()
    assert result.factors["LeftShank"][0] == pytest.approx(0.93, rel=0.01)


def test_factors_move_markers_as_the_difference_of_two_models_says() -> None:
    """Positions are linear in the scale factors, with exactly the computed derivatives, for all types of joints."""
    model = osimlite.read(FIXTURES / "kinematics" / "mixed_joint_tree.osim")
    bodies = [body for body in model.components(osimlite.Body)]
    for body in bodies:
        model.add(
            osimlite.Marker(
                name=f"on {body.name}", socket_parent_frame=body, location=(0.1, -0.2, 0.3)
            )
        )
    names = [f"on {body.name}" for body in bodies]
    carriers = {body.name: "" for body in bodies}
    segments = Segments.group_bodies(carriers, carriers, by_axis=True, symmetric=False)
    shape, rng = ScalableMarkers(model, names, segments), np.random.default_rng(3)
    sizes = rng.uniform(0.7, 1.4, len(segments.parts))
    ones = np.ones_like(sizes)
    mechanism, stations = shape.scale_mechanism(sizes)
    first, places = shape.scale_mechanism(ones)
    values = rng.uniform(-0.5, 0.5, (4, len(mechanism.coordinates)))
    columns, _ = shape.compute_derivatives(values)
    for q, own in zip(values, columns, strict=True):
        there = [mechanism.at(q).point(*place) for place in stations]
        here = [first.at(q).point(*place) for place in places]
        assert np.array(there) == pytest.approx(np.array(here) + own @ (sizes - ones), abs=1e-12)


def test_bodies_without_markers_go_with_others() -> None:
    """The talus is scaled with the foot, and the patella with the thigh."""
    carriers = {
        "pelvis": "ground",
        "femur_r": "pelvis",
        "patella_r": "femur_r",
        "tibia_r": "femur_r",
    }
    carriers |= {
        "talus_r": "tibia_r",
        "calcn_r": "talus_r",
        "toes_r": "calcn_r",
        "femur_l": "pelvis",
    }
    marked = {"pelvis", "femur_r", "tibia_r", "calcn_r", "femur_l"}
    parts = Segments.group_bodies(carriers, marked, by_axis=False, symmetric=True).parts
    groups = [
        {"pelvis"},
        {"femur_r", "femur_l", "patella_r"},
        {"tibia_r"},
        {"talus_r", "calcn_r", "toes_r"},
    ]
    assert [set(part.bodies) for part in parts] == groups
    assert len(Segments.group_bodies(carriers, marked, by_axis=True, symmetric=False).parts) == 15


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("femur_r", "femur_l"),
        ("LeftShank", "RightShank"),
        ("r_foot", "l_foot"),
        ("R_HUMERUS", "L_HUMERUS"),
    ],
)
def test_names_of_sides(one: str, other: str) -> None:
    """Names of sides follow the conventions of public models."""
    names = {one: 0, other: 1, "torso": 2, "rotor": 3}
    assert (get_opposite_name(one, names), get_opposite_name(other, names)) == (other, one)
    assert (
        get_opposite_name("torso", names) == "torso"
        and get_opposite_name("rotor", names) == "rotor"
    )


def test_the_setup_makes_the_same_model(tmp_path: Path) -> None:
    """The scale tool creates the same model from the generic file."""
    data, _ = person(2)
    model = marked()
    osimlite.write(model, tmp_path / "generic.osim")
    result = fit(model, {"moving": data}, held=HELD, mass=70.0)
    texts = create_person_files(result, tmp_path / "generic.osim", tmp_path / "subject", 70.0)
    (tmp_path / "subject").mkdir()
    for name, text in texts.items():
        (tmp_path / "subject" / name).write_text(text)
    setup = read_any(tmp_path / "subject" / SETUP)
    assert isinstance(setup, ScaleTool)
    made = compute_scaled_model(setup, tmp_path / "subject").model
    assert_same(
        osimlite.read_text(osimlite.to_text(made)),
        osimlite.read(tmp_path / "subject" / "generic_fitted.osim"),
    )
    assert sum(body.mass for body in made.components(osimlite.Body)) == pytest.approx(70.0)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"held": ["LeftShank_uper"]}, "LeftShank_upper"),
        ({"weights": {"LeftShank_uper": 1.0}}, "LeftShank_upper"),
        ({"weights": {"LeftShank_upper": -1.0}}, "is invalid"),
        ({"frames": 0}, "at least 1"),
        ({"trials": {}}, "at least one trial"),
        ({"trials": {"walk": {"nose": np.zeros((3, 3))}}}, "nose"),
        ({"trials": {"walk": {name: np.full((3, 3), np.nan) for name in HELD}}}, "three markers"),
        ({"trials": {"walk": {HELD[0]: np.zeros((3, 3))}}}, "three markers"),
    ],
)
def test_what_cannot_be_fitted_is_told(given: dict[str, Any], words: str) -> None:
    """The error is one sentence."""
    trials = given.pop("trials", None)
    with pytest.raises(OsimliteError, match=words) as caught:
        fit(marked(), {"moving": person(0)[0]} if trials is None else trials, **given)
    assert isinstance(caught.value, SettingError | OsimliteError)


def test_markers_that_stand_still_are_no_reason_to_fail() -> None:
    """Frames without motion determine sizes by distances of markers only, within plausible limits."""
    data, _ = person(1)
    frozen = {name: np.tile(rows[0], (20, 1)) for name, rows in data.items()}
    result = fit(marked(), {"still": frozen}, held=HELD)
    assert result.errors(result.after)["still"] < 0.01
    assert max(max(own) for own in result.factors.values()) < 1.6


def test_bodies_that_are_fixed_to_ground_and_poses_that_are_given() -> None:
    """Markers on bodies that are welded to ground determine the size of these bodies."""
    model = osimlite.Model(name="stand")
    post = osimlite.Body(name="post", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
    arm = osimlite.Body(name="arm", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
    model.add(post, arm)
    model.add(
        osimlite.WeldJoint(name="weld", socket_parent_frame=model.ground, socket_child_frame=post)
    )
    top = osimlite.PhysicalOffsetFrame(name="top", socket_parent=post, translation=(0.0, 1.0, 0.0))
    post.components.append(top)
    model.add(osimlite.PinJoint(name="pin", socket_parent_frame=top, socket_child_frame=arm))
    for body in (post, arm):
        for number, place in enumerate(np.eye(3)):
            model.add(
                osimlite.Marker(
                    name=f"{body.name}{number}",
                    socket_parent_frame=body,
                    location=tuple(place.tolist()),
                    fixed=True,
                )
            )
    mechanism = osimlite.mechanism(model)
    places = [1.2 * np.array([*mechanism.station_positions([0.1 * k]).values()]) for k in range(10)]
    names = [path.rpartition("/")[2] for path in mechanism.station_positions([0.0])]
    data = {name: np.array([row[k] for row in places]) for k, name in enumerate(names)}
    result = fit(model, {"turning": data})
    assert result.factors["post"] == pytest.approx([1.2] * 3, rel=1e-3)
    assert result.factors["arm"] == pytest.approx([1.2] * 3, rel=1e-3)
    (coordinate,) = model.components(osimlite.Coordinate)
    coordinate.locked = True
    assert (
        fit(model, {"still": {name: rows[:1] for name, rows in data.items()}}).factors["arm"][0]
        > 1.19
    )
