"""Tests of muscles in the colours of their activations."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite import Model
from osimlite.io.tables.storage import write_sto
from osimlite.mechanics.multibody import build_mechanism
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.muscles import PathActuator
from osimlite.schema.paths import PathPoint
from osimlite.view import ModelView
from osimlite.view.motion import read_activations
from osimlite.view.recording import read_recording
from tests.view.motions import Recorded

pytest.importorskip("PIL.Image")


@pytest.fixture
def model() -> Model:
    """Return a model with two path actuators that are fixed to ground."""
    model = Model(name="two")
    for name, height in (("one.a", 0.0), ("two", 0.5)):
        force = PathActuator(name=name, optimal_force=1.0)
        for number, x in enumerate((-0.2, 0.2)):
            point = PathPoint(
                name=f"p{number}", socket_parent_frame="/ground", location=(x, height, 0.0)
            )
            force.geometry_path.path_point_set.objects.append(point)
        model.add(force)
    return model


def moving(model: Model, states: dict[str, tuple[float, float]]) -> ModelView:
    rows = np.zeros((2, 0))
    columns = {label: np.array(values) for label, values in states.items()}
    return ModelView.from_model(
        model, motion=Recorded(np.array((0.0, 1.0)), (), rows, rows, {}, columns)
    )


def test_activations_have_the_names_of_both_versions_and_are_from_0_to_1(model):
    shown = moving(
        model,
        {
            "one.a.activation": (-0.5, 0.25),
            "/forceset/two/activation": (1.5, np.nan),
            "two.length": (0, 0),
        },
    )
    assert {
        path: levels.tolist()
        for path, levels in read_activations(shown.scene, shown.motion).items()
    } == {
        "/forceset/one.a": [0.0, 0.25],
        "/forceset/two": [1.0, 0.0],
    }


def test_a_picture_shows_those_of_its_moment(model, tmp_path):
    from PIL import Image

    shown = moving(model, {"/forceset/two/activation": (0.0, 1.0)})
    for time, blue in ((0.0, True), (1.0, False)):
        picture = np.asarray(
            Image.open(shown.write_picture(tmp_path / "a.png", (160, 120), time)).convert("RGB")
        )
        red, _, other = picture.astype(int).transpose(2, 0, 1)
        assert ((other - red > 60).any(), (red - other > 60).any()) == (blue, not blue)


def test_a_file_of_states_has_them(tmp_path):
    walker = dynamic_walker()
    mechanism = build_mechanism(walker)
    labels = [
        f"{mechanism.coordinates[0].path}/value",
        "/forceset/a/activation",
        "/forceset/a/fiber_length",
    ]
    write_sto(tmp_path / "a.sto", "a", (0.0, 1.0), labels, ((0.1, 0.3, 0.2), (0.2, 0.4, 0.2)))
    result = read_recording(walker, mechanism, tmp_path / "a.sto").auxiliary
    assert {label: column.tolist() for label, column in result.items()} == {labels[1]: [0.3, 0.4]}
