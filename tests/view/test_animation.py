from __future__ import annotations

import dataclasses
import sys

import numpy as np
import pytest

from osimlite.errors import MissingDependency, OsimliteError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.geometry import Mesh
from osimlite.schema.model import Model
from osimlite.view import animate
from osimlite.view.animation import Film, round_down, to_hex
from osimlite.view.collect import build_scene
from osimlite.view.picture import FORCE
from tests.view.motions import Recorded, stroll

Image = pytest.importorskip("PIL.Image")

SMALL = (320, 240)


def scene_of(model):
    return build_scene(model, build_mechanism(model))


def frames(path):
    with Image.open(path) as film:
        assert film.size == SMALL
        for number in range(film.n_frames):
            film.seek(number)
            yield np.asarray(film.convert("RGB")).astype(int), film.info["duration"]


def has(picture, color):
    """Return the number of pixels of a colour, within the tolerance of a shared palette."""
    wanted = [int(color[k : k + 2], 16) for k in (1, 3, 5)]
    return int((np.abs(picture - wanted).max(axis=2) < 16).sum())


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    path = tmp_path_factory.mktemp("film") / "walk.gif"
    told = []
    result = animate(
        dynamic_walker(),
        stroll(),
        path,
        size=SMALL,
        progress=lambda done, all_: told.append((done, all_)),
    )
    assert result == path
    return list(frames(path)), told


def test_the_film_runs_at_the_speed_of_the_motion(film):
    pictures, told = film
    assert len(pictures) == 13
    assert {duration for _, duration in pictures} == {40}
    assert told == [(k, 13) for k in range(1, 14)]


def test_forces_are_drawn_while_they_act(film):
    pictures = [picture for picture, _ in film[0]]
    # The foot is loaded from 0.1 to 0.3 s; the scale of the forces has the same colour all the
    # time.
    scale = has(pictures[0], to_hex(FORCE))
    assert scale > 0
    assert has(pictures[5], to_hex(FORCE)) > scale + 50


def test_slow_motion_has_more_frames(tmp_path):
    path = animate(dynamic_walker(), stroll(), tmp_path / "slow.gif", size=SMALL, speed=0.5, fps=20)
    pictures = list(frames(path))
    assert len(pictures) == 21 and pictures[0][1] == 50


def test_the_camera_follows_the_mass_centre_of_what_moves():
    mechanism = build_mechanism(dynamic_walker())
    film = Film(scene_of(dynamic_walker()), stroll(), 25, 1.0, "xy")
    names = [body.name for body in mechanism.bodies]
    assert [name for name, moves in zip(names, film.moving, strict=False) if not moves] == [
        "Platform"
    ]
    for number in (0, 7):
        q = mechanism.values({"Pelvis_tx": film.times[number]})
        total = (
            mechanism.center_of_mass(q) * 6.0 - film.poses[number].origins[names.index("Platform")]
        )
        assert film.focus[number] == pytest.approx(total / 5.0)


def test_all_that_moves_is_in_the_picture():
    film = Film(scene_of(dynamic_walker()), stroll(), 25, 1.0, "xy")
    seen = 0
    for pose, focus in zip(film.poses, film.project_points(film.focus), strict=True):
        for item in film.scene.iterate_visible_items():
            if film.moving[item.body]:
                away = np.abs(
                    film.project_points(
                        pose.transform_points(item.body, film.scene.compute_corners(item))
                    )
                    - focus
                )
                assert (away <= film.reach + 1e-12).all()
                seen += 1
    assert seen >= 5 * len(film.poses)
    # The platform is 20 m long and does not move: scenery of that size is not shown completely.
    assert film.reach.max() < 2.0


def test_what_stands_still_is_shown_if_it_is_not_too_large():
    motion = stroll()
    knee = np.array(motion.coordinates) == "RKnee_rz"
    model = dynamic_walker()
    del model.body_set.objects[0].attached_geometry[:]
    motion = dataclasses.replace(
        motion, values=motion.values[0] + 0.5 * np.outer(motion.times, knee)
    )
    film = Film(scene_of(model), motion, 25, 1.0, "xy")
    names = [body.name for body in film.mechanism.bodies]
    assert [name for name, moves in zip(names, film.moving, strict=False) if moves] == [
        "RightShank"
    ]
    pelvis = film.project_points(film.poses[0].origins[[names.index("Pelvis")]])[0]
    assert (np.abs(pelvis - film.project_points(film.focus)[0]) < film.reach).all()


def test_ground_stays_in_the_picture_of_a_jump():
    """The picture includes the ground unless it is so far away that the model would be too small."""
    motion = stroll()
    level = motion.values[0] * (np.array(motion.coordinates) != "platform_rz")
    up = np.outer(motion.times, np.array(motion.coordinates) == "Pelvis_ty")
    jump, drop = (
        Film(
            scene_of(dynamic_walker()),
            dataclasses.replace(motion, values=level + speed * up),
            25,
            1.0,
            "xy",
        )
        for speed in (1.0, 40.0)
    )
    highest = jump.project_points(jump.focus)[-1, 1]
    assert jump.reach[1] == pytest.approx(highest - 0.025, abs=0.01)
    assert drop.reach[1] < 0.8 < jump.reach[1]


def test_a_model_without_shapes_is_a_stick_figure(tmp_path):
    model = dynamic_walker()
    for body in model.body_set.objects:
        del body.attached_geometry[:]
    path = animate(
        model, dataclasses.replace(stroll(), forces={}), tmp_path / "sticks.gif", size=SMALL
    )
    with_sticks = next(frames(path))[0]
    del model.contact_geometry_set.objects[:], model.force_set.objects[:]
    assert (with_sticks.max(axis=2) < 70).sum() > 300


def test_meshes_beside_the_file_are_drawn(tmp_path):
    (tmp_path / "sheet.obj").write_text("v -1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    model, motion = dynamic_walker(), stroll(2)
    pelvis = model.body_set.objects[1]
    del pelvis.attached_geometry[:]
    pelvis.attach(Mesh(mesh_file="sheet.obj"))
    options = {"size": SMALL, "fps": 2}
    (without, _), *_ = frames(animate(model, motion, tmp_path / "a.gif", **options))
    (result, _), *_ = frames(
        animate(model, motion, tmp_path / "b.gif", file=tmp_path / "walker.osim", **options)
    )
    assert (without != result).any(axis=2).sum() > 1000


def test_a_model_without_coordinates_has_a_film_too(tmp_path):
    still = Recorded(np.array([0.0, 0.1]), (), np.zeros((2, 0)), np.zeros((2, 0)))
    assert (
        len(list(frames(animate(Model(name="empty"), still, tmp_path / "still.gif", size=SMALL))))
        == 3
    )


@pytest.mark.parametrize("plane", ["yz", "xz"])
def test_other_planes_can_be_drawn(plane, tmp_path):
    motion = dataclasses.replace(
        stroll(), times=stroll().times[:5], values=stroll().values[:5], forces={}
    )
    assert (
        len(
            list(
                frames(
                    animate(dynamic_walker(), motion, tmp_path / "a.gif", size=SMALL, plane=plane)
                )
            )
        )
        == 2
    )


def test_a_plane_that_is_none_is_refused(tmp_path):
    with pytest.raises(OsimliteError, match="not 'zx'"):
        animate(dynamic_walker(), stroll(), tmp_path / "a.gif", plane="zx")


def test_one_moment_makes_a_picture(tmp_path):
    motion = stroll()
    still = Recorded(motion.times[:1], motion.coordinates, motion.values[:1], motion.speeds[:1])
    assert len(list(frames(animate(dynamic_walker(), still, tmp_path / "a.gif", size=SMALL)))) == 1


@pytest.mark.parametrize(
    ("options", "said"),
    [({"fps": 0}, "1 to 50"), ({"fps": 60}, "1 to 50"), ({"speed": 0.0}, "positive")],
)
def test_options_out_of_range_are_refused(options, said, tmp_path):
    with pytest.raises(OsimliteError, match=said):
        animate(dynamic_walker(), stroll(), tmp_path / "a.gif", **options)
    assert not list(tmp_path.iterdir())


def test_nothing_is_left_behind_by_a_failure(tmp_path, monkeypatch):
    motion = stroll()
    empty = Recorded(motion.times[:0], motion.coordinates, motion.values[:0], motion.speeds[:0])
    with pytest.raises(OsimliteError, match="no rows"):
        animate(dynamic_walker(), empty, tmp_path / "a.gif")
    monkeypatch.setitem(sys.modules, "PIL.Image", None)
    with pytest.raises(MissingDependency, match=r"needs Pillow.*osimlite\[view\]"):
        animate(dynamic_walker(), motion, tmp_path / "a.gif")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("value", "round_"), [(0.37, 0.2), (5.0, 5.0), (999.0, 500.0), (1.0, 1.0)])
def test_scales_are_round(value, round_):
    assert round_down(value) == pytest.approx(round_)
