"""Tests of the viewer's page and of its server, without a browser."""

from __future__ import annotations

import json
import re
import urllib.error
import urllib.request
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError
from osimlite.io.tables.storage import write_sto
from osimlite.mechanics.multibody import build_mechanism
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.view import ModelView
from osimlite.view.page import page_data, page_text
from osimlite.view.recording import compute_forces, read_recording
from tests.view.motions import stroll


def walker(**more) -> ModelView:
    model = dynamic_walker()
    return ModelView.from_model(model, build_mechanism(model), **more)


def data_of(text: str):
    (result,) = re.findall(
        r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL
    )
    return json.loads(result)


def test_the_page_holds_everything_and_asks_for_nothing(tmp_path: Path):
    text = walker(motion=stroll()).write_page(tmp_path / "page.html").read_text()
    assert not re.search(r"<(?:script|link|img)[^>]+(?:src|href)=", text)
    assert "@" not in re.findall(r"<title>(.*?)</title>", text)[0]
    assert "default-src 'none'" in text and "three.js" in text
    data = data_of(text)
    assert {item["layer"] for item in data["items"]} >= {"geometry", "contact"}
    assert len(data["motion"]["forces"]) == 2 and not data["motion"]["travels"]


def test_the_grid_lies_on_the_ground_of_the_model():
    view = walker()
    data = page_data(view.model, view.scene, None, (), view.q)
    matrix = np.reshape(data["floor"]["matrix"], (3, 4))
    body = view.scene.mechanism.bodies[data["floor"]["body"]]
    assert body.name == "Platform"
    assert np.linalg.det(matrix[:, :3]) == pytest.approx(1.0, abs=1e-12)
    # The exercise rotates its plane by -1.57 rad, which is not exactly a right angle.
    assert matrix[:, 1] == pytest.approx([-np.cos(1.57), np.sin(1.57), 0.0], abs=1e-12)


def test_words_of_a_model_cannot_end_the_data():
    model = dynamic_walker()
    model.name = "a</script><script>alert(1)</script>"
    view = ModelView.from_model(model, build_mechanism(model))
    text = page_text(page_data(model, view.scene, None, (), view.q))
    assert "<script>alert(1)" not in text
    assert data_of(text)["name"] == model.name


def test_the_tree_has_components_with_their_properties():
    view = walker()
    data = page_data(view.model, view.scene, None, (), view.q)
    nodes = {node["path"]: node for node in data["tree"]}
    pelvis = nodes["/bodyset/Pelvis"]
    tags = data["tags"]["Body"]
    assert pelvis["kind"] == "Body" and data["tree"][pelvis["parent"]]["path"] == "/bodyset"
    assert pelvis["values"][tags.index("mass")] == repr(
        view.model.body_set.objects[1].mass
    ).removesuffix(".0")
    assert tags.index("mass") in pelvis["given"]
    sphere = next(node for node in data["tree"] if node["kind"] == "ContactSphere")
    assert "Appearance.color" in data["tags"]["ContactSphere"] and sphere["name"] in sphere["path"]
    assert not [
        node for node in data["tree"] if node["kind"] == "FrameGeometry" and not node["path"]
    ]


def test_sliders_know_what_stays_as_it_is():
    view = walker()
    view.model.joint_set.objects[0].coordinates[0].locked = True
    mechanism = build_mechanism(view.model)
    data = page_data(
        view.model,
        ModelView.from_model(view.model, mechanism).scene,
        None,
        (),
        mechanism.assemble({}),
    )
    assert [c["still"] for c in data["coordinates"]].count("locked") == 1
    for coordinate, value in zip(data["coordinates"], data["q"], strict=True):
        assert coordinate["range"][0] <= value <= coordinate["range"][1]


def ask(server, question: bytes, host: str | None = None):
    request = urllib.request.Request(
        server.url + "assemble", question, {} if host is None else {"Host": host}
    )
    with urllib.request.urlopen(request) as answer:
        return json.loads(answer.read())


def test_the_server_answers_the_page_and_nobody_else():
    view = walker()
    with view.create_server() as server:
        with urllib.request.urlopen(server.url) as page:
            assert data_of(page.read().decode())["server"] is True
        assert (
            ask(server, json.dumps({"values": view.q.tolist()}).encode())["values"]
            == view.q.tolist()
        )
        assert (
            "not a number"
            in ask(server, json.dumps({"values": [np.nan] * len(view.q)}).encode())["error"]
        )
        for wrong in (
            urllib.request.Request(server.url + "etc/passwd"),
            urllib.request.Request(server.url, headers={"Host": "example.org"}),
            urllib.request.Request(server.url + "assemble", b"{}", {"Host": "example.org"}),
        ):
            with pytest.raises(urllib.error.HTTPError) as caught:
                urllib.request.urlopen(wrong)
            assert caught.value.code in (403, 404)
            caught.value.close()
        with pytest.raises(OsimliteError, match="--port"):
            view.create_server(int(server.url.rsplit(":", 1)[1].strip("/")))


def test_forces_of_a_file_of_states_are_those_of_the_simulation(tmp_path: Path):
    model = dynamic_walker()
    trajectory = osimlite.simulate(model, to=0.3, report_interval=0.02)
    trajectory.write(tmp_path)
    mechanism = build_mechanism(model)
    recording = read_recording(model, mechanism, tmp_path / "states.sto")
    assert recording.forces.keys() == trajectory.forces.keys()
    for label, column in trajectory.forces.items():
        assert recording.forces[label] == pytest.approx(column, rel=1e-9, abs=1e-9)
    told = read_recording(model, mechanism, tmp_path / "states.sto", tmp_path / "forces.sto")
    assert told.forces["RFootForce.RightShank.force.Y"] == pytest.approx(
        trajectory.forces["RFootForce.RightShank.force.Y"], rel=1e-9, abs=1e-9
    )


def test_a_motion_without_speeds_has_no_forces(tmp_path: Path):
    model, motion = dynamic_walker(), stroll()
    mechanism = build_mechanism(model)
    write_sto(
        tmp_path / "walk.mot", "walk", motion.times, motion.coordinates, motion.values.tolist()
    )
    recording = read_recording(model, mechanism, tmp_path / "walk.mot", values={"RKnee_rz": -0.5})
    assert not recording.forces
    knee = list(motion.coordinates).index("RKnee_rz")
    assert set(recording.values[:, knee]) == {-0.5}
    others = np.delete(np.arange(len(motion.coordinates)), knee)
    assert recording.values[:, others] == pytest.approx(motion.values[:, others])
    assert compute_forces(model, mechanism, motion.times[:2], motion.values[:2], motion.speeds[:2])


def test_a_picture_shows_the_moment_asked_for(tmp_path: Path):
    image = pytest.importorskip("PIL.Image")
    view = walker(motion=stroll())
    size = (240, 180)
    pictures = []
    for time in (None, 0.2, 0.45):
        with image.open(view.write_picture(tmp_path / "a.png", size, time)) as picture:
            assert picture.size == size
            pictures.append(np.asarray(picture.convert("RGB")).astype(int))
    # Force arrows are orange; the walker's platform is darker and more red.
    parts = [np.moveaxis(picture, 2, 0) for picture in pictures]
    orange = [
        int(((r > 80) & (g > 0.3 * r) & (g < 0.6 * r) & (b < 0.2 * r)).sum()) for r, g, b in parts
    ]
    assert orange[0] == orange[2] < orange[1] - 20
    with pytest.raises(OsimliteError, match=r"from 0 to 0\.5 s"):
        view.write_picture(tmp_path / "b.png", size, 0.7)
    with pytest.raises(OsimliteError, match=r"written as \.png"):
        view.write_picture(tmp_path / "b.xyz", size)
    with pytest.raises(OsimliteError, match="a time was given without a motion"):
        walker().write_picture(tmp_path / "b.png", size, 0.1)
    assert not (tmp_path / "b.png").exists()


def test_a_model_without_bodies_is_shown_too(tmp_path: Path):
    pytest.importorskip("PIL", reason="needs pillow (extra 'view')")
    blank = ModelView.from_model(osimlite.Model(name="blank"))
    assert "blank" in blank.write_page(tmp_path / "blank.html").read_text()
    assert blank.write_picture(tmp_path / "blank.png", size=(40, 30)).stat().st_size > 0


def test_the_former_name_of_the_class_warns():
    with pytest.warns(DeprecationWarning, match=r"use osimlite\.view\.ModelView$"):
        former = osimlite.view.Shown
    assert former is osimlite.view.ModelView
