"""Tests of scaling: rules of classes, masses and inertias, measurements, and OpenSim's scaled model."""

from __future__ import annotations

import gzip
import re
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.errors import ModelError, OsimliteError, SettingError
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.measuring import select_frames
from osimlite.fitting.placing import place_markers
from osimlite.fitting.scale_tool import compute_scaled_model
from osimlite.fitting.scaling import get_scale_rules, scale_model
from osimlite.io.tables.storage import read_sto
from osimlite.schema.facts import HOLDER, PATH, SELF
from osimlite.schema.registry import MODULES
from tests.fitting.support import assert_same

CASE = "oracle/tools/reference/scale_gait2354"


def test_every_rule_is_about_a_property_that_is_there() -> None:
    """Each rule refers to a property, and to a frame, a socket or a path."""
    count = 0
    for name, module in MODULES.items():
        cls = getattr(import_module(module), name)
        for property_name, rule in get_scale_rules(cls).items():
            whose = rule.split()[0]
            assert property_name in cls.model_fields, name
            assert whose in (SELF, HOLDER, PATH) or whose in cls.model_fields, name
            count += 1
    assert count > 50


@pytest.fixture
def setup(shared: Path, tmp_path: Path) -> Path:
    """Copy the setup of a gait model and the files that it names."""
    for source in (shared / CASE).iterdir():
        data = source.read_bytes()
        name = source.name.removesuffix(".gz")
        (tmp_path / f"their_{name}").write_bytes(
            gzip.decompress(data) if source.suffix == ".gz" else data
        )
    tool: Any = osimlite.read_document(tmp_path / "their_scale.xml")
    names = {
        "gait2354.osim": tool.generic_model_maker.model_file,
        "markers.xml": tool.generic_model_maker.marker_set_file,
        "static.trc": tool.model_scaler.marker_file,
    }
    for theirs, name in names.items():
        (tmp_path / name).write_bytes((tmp_path / f"their_{theirs}").read_bytes())
    return tmp_path


def test_a_gait_model_is_scaled_as_opensim_scales_it(setup: Path) -> None:
    """Compare model and factors with OpenSim's; the pose of the subject must have no larger errors than OpenSim's."""
    tool: Any = osimlite.read_document(setup / "their_scale.xml")
    result = compute_scaled_model(tool, setup)
    ours = osimlite.read_text(result.texts[tool.model_scaler.output_model_file])
    assert_same(ours, osimlite.read(setup / "their_subject01_scaledOnly.osim"))
    theirs: Any = osimlite.read_document(setup / "their_subject01_scaleSet_applied.xml")
    assert result.measured is not None and result.placed is not None
    for scale in theirs.objects:
        # OpenSim prints six digits of the factors.
        assert result.measured.factors[scale.segment] == pytest.approx(scale.scales, rel=1e-5)
    assert (
        result.measured.notes[0]
        == "body 'patella_r' of measurement 'thigh': the model has no such body"
    )
    placed = osimlite.read_text(result.texts[tool.marker_placer.output_model_file])
    assert_same(placed, osimlite.read(setup / "their_subject01_simbody.osim"), but="location")
    text = result.texts[tool.marker_placer.output_motion_file]
    their_text = (setup / "their_subject01_static_output.mot").read_text()
    assert text.split("\n")[:7] == their_text.split("\n")[:7]
    assert (
        result.placed.pose.costs[0] == pytest.approx(2.0127e-4, rel=3e-3)
        and not result.placed.pose.unsettled
    )
    (setup / "pose.mot").write_text(text)
    pose, known = (
        read_sto(setup / "pose.mot"),
        read_sto(setup / "their_subject01_static_output.mot"),
    )
    assert pose.columns == known.columns and pose.rows == pytest.approx(known.rows, abs=0.02)
    assert next(iter(result.placed.describe_pose()))[1].endswith(
        "OpenSim recommends less than 1 cm (root mean square) and 2 cm (largest) for markers on bones"
    )
    assert len(result.placed.moved) > 30 and max(result.placed.moved.values()) < 0.2


def body_model() -> osimlite.Model:
    """Return a model of a thigh with markers at its two ends."""
    model = osimlite.Model(name="leg")
    thigh = osimlite.Body(
        name="thigh",
        mass=8.0,
        mass_center=(0.0, -0.2, 0.0),
        inertia=(0.1, 0.02, 0.1, 0.01, 0.0, 0.0),
    )
    model.add(thigh)
    model.add(
        osimlite.FreeJoint(name="hip", socket_parent_frame=model.ground, socket_child_frame=thigh)
    )
    for name, y in (("top", 0.0), ("bottom", -0.4)):
        model.add(osimlite.Marker(name=name, socket_parent_frame=thigh, location=(0.0, y, 0.0)))
    return model


STATIC = {
    "top": [[0.0, 1.0, 0.0]] * 3,
    "bottom": [[0.0, 0.5, 0.0], [0.0, 0.52, 0.0], [0.0, 0.54, 0.0]],
}
LENGTH = {"length": ([("top", "bottom")], {"thigh": "Y"})}


def test_distances_of_markers_scale_bodies() -> None:
    """The factor is the mean over the frames, along the named axes; the input model is not changed."""
    model = body_model()
    result = osimlite.scale(model, STATIC, measurements=LENGTH)
    assert result.measured is not None and result.measured.ratios == {
        "length": pytest.approx(0.48 / 0.4)
    }
    thigh: Any = result.model["/bodyset/thigh"]
    assert thigh.mass_center == pytest.approx((0.0, -0.24, 0.0)) and thigh.mass == pytest.approx(
        8.0 * 1.2
    )
    assert model["/bodyset/thigh"].mass == 8.0
    both = osimlite.scale(
        model, STATIC, measurements=LENGTH, factors={"thigh": (2.0, 1.0, 1.0)}, mass=5.0
    )
    assert both.model["/bodyset/thigh"].mass == pytest.approx(5.0)
    assert both.model["/markerset/bottom"].location == pytest.approx((0.0, -0.4, 0.0))


def test_markers_are_placed_where_they_were_measured() -> None:
    """Markers move to their measured positions in the fitted pose; fixed markers stay."""
    model = body_model()
    model["/markerset/top"].fixed = True
    result = osimlite.scale(model, STATIC, measurements=LENGTH, place=True)
    assert result.placed is not None and list(result.placed.moved) == ["bottom"]
    state = result.placed.pose.mechanism.at(result.placed.pose.values[0])
    bottom = np.array(result.model["/markerset/bottom"].location)
    assert state.point(0, bottom) == pytest.approx((0.0, 0.52, 0.0), abs=1e-9)
    assert result.model["/markerset/top"].location == (0.0, 0.0, 0.0)


def test_inertia_of_equal_factors_is_exact() -> None:
    """Inertia scales with the square of the factor and with the mass."""
    model = body_model()
    scale_model(model, {"thigh": (1.1, 1.1, 1.1)})
    assert model["/bodyset/thigh"].inertia == pytest.approx(
        np.array((0.1, 0.02, 0.1, 0.01, 0.0, 0.0)) * 1.1**5
    )
    model = body_model()
    scale_model(model, {"thigh": (1.1, 1.1, 1.1)}, preserve_mass_distribution=True)
    assert model["/bodyset/thigh"].inertia == pytest.approx(
        np.array((0.1, 0.02, 0.1, 0.01, 0.0, 0.0)) * 1.1**2
    )


def test_what_cannot_be_scaled_is_told() -> None:
    """Unknown names, missing markers and empty ranges are reported."""
    model = body_model()
    with pytest.raises(SettingError, match="no body 'tigh'; did you mean 'thigh'"):
        osimlite.scale(model, factors={"tigh": 1.2})
    with pytest.raises(
        SettingError,
        match="measurement 'thigh' must have pairs of markers, and for each body the axes",
    ):
        osimlite.scale(model, {}, measurements={"thigh": ([("one", "two")], ["thigh"])})  # type: ignore[arg-type]
    with pytest.raises(SettingError, match="need markers of the standing subject"):
        osimlite.scale(model, measurements=LENGTH)
    notes = osimlite.scale(model, {"top": STATIC["top"]}, measurements=LENGTH).measured
    assert notes is not None and notes.notes == [
        "measurement 'length': the data have no marker 'bottom'"
    ]
    with pytest.raises(OsimliteError, match=r"is one of the model \(top and bottom\)"):
        osimlite.scale(model, {"elsewhere": STATIC["top"]}, place=True)
    gap = {**STATIC, "bottom": [[0.0, np.nan, 0.0], *STATIC["bottom"][1:]]}
    notes = osimlite.scale(model, gap, measurements=LENGTH).measured
    assert notes is not None and "were not seen in every frame" in notes.notes[0]
    with pytest.raises(SettingError, match="before it begins"):
        select_frames(np.arange(3.0), 2.0, 1.0)
    slider = osimlite.Model(name="slider")
    body = osimlite.Body(name="b", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
    slider.add(body)
    slider.add(
        osimlite.PlanarJoint(name="j", socket_parent_frame=slider.ground, socket_child_frame=body)
    )
    names = [item.name for item in slider.components(osimlite.Coordinate)]
    slider.add(
        osimlite.CoordinateCouplerConstraint(
            name="c",
            independent_coordinate_names=(names[0],),
            dependent_coordinate_name=names[1],
            coupled_coordinates_function=osimlite.LinearFunction(coefficients=(1.0, 0.0)),
        )
    )
    with pytest.raises(ModelError, match="use one factor for all its axes"):
        scale_model(slider, {"ground": (1.0, 2.0, 1.0)})


@pytest.mark.parametrize(
    ("start", "end", "message"),
    [
        (3.0, 4.0, "the static trial ends at 2 s, and the time range starts at 3 s; set"),
        (-2.0, -1.0, "the static trial starts at 0 s, and the time range ends at -1 s; set"),
        (2.0, 1.0, "starts at 2 s and must end later, but it ends at 1 s; set"),
        (1.0, 1.0, "starts at 1 s and must end later, but it ends at 1 s; set"),
        (0.2, 0.8, "the static trial has no frame between 0.2 and 0.8 s; set"),
    ],
)
def test_a_range_without_frames_is_explained(start: float, end: float, message: str) -> None:
    with pytest.raises(SettingError, match=re.escape(message)):
        place_markers(body_model(), MarkerData.from_arrays(STATIC, None), [], start, end)


@pytest.mark.parametrize(
    ("first", "last", "frames"),
    [(-1.0, 9.0, (0, 4)), (0.5, 1.5, (0, 3)), (1.0, 2.0, (1, 3)), (7.0, 8.0, (3, 4))],
)
def test_frames_of_a_range_are_those_of_opensim(
    first: float, last: float, frames: tuple[int, int]
) -> None:
    """OpenSim takes the last frame not after the beginning to the first frame not before the end."""
    result = select_frames(np.arange(4.0), first, last)
    assert (result.start, result.stop) == frames
