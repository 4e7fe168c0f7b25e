"""Tests of coordinates that no measurement determines: they are named, and keep their default values."""

from __future__ import annotations

import gzip
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.fitting.fit_messages import describe_fit
from osimlite.fitting.marker_data import MarkerData
from tests.cli.command import run
from tests.labs import LABS, change, copy_lab

MARKERS = ("ASI", "PSI", "SAC", "THI", "KNE", "TIB", "ANK", "TOE")


def fit(model: Path, markers: tuple[str, ...], **options: Any):
    """Fit the walk of a lab to some of its markers.

    Args:
        model: model file.
        markers: names of the markers.
        options: options of inverse kinematics.
    """
    data = MarkerData.from_source(LABS / "unseen" / "walk.trc")
    arrays = {
        name: data.positions[:, place] for place, name in enumerate(data.names) if name in markers
    }
    return osimlite.inverse_kinematics(osimlite.read(model), arrays, times=data.times, **options)


@pytest.mark.parametrize(
    ("count", "names"), [(8, ()), (6, ()), (5, ("knee_angle",)), (3, ("hip_flexion", "knee_angle"))]
)
def test_joints_that_no_marker_sees(count: int, names: tuple[str, ...]) -> None:
    motion = fit(LABS / "unseen" / "leg.osim", MARKERS[:count])
    assert motion.undetermined == names
    assert motion.summary.get("undetermined", []) == list(names)
    words = " ".join(message for _, message in describe_fit(motion))
    assert all(name in words for name in names)
    assert ("determines" in words) == bool(names)
    for name in names:
        place = motion.mechanism.coordinate_names.index(name)
        assert (motion.values[:, place] == motion.mechanism.coordinates[place].default_value).all()


def test_a_goal_or_a_lock_determines(tmp_path: Path) -> None:
    model = LABS / "unseen" / "leg.osim"
    assert fit(model, MARKERS[:5], coordinates={"knee_angle": (0.1, -0.3)}).undetermined == ()
    folder = copy_lab("unseen", tmp_path)
    change(
        folder / "leg.osim",
        ('<Coordinate name="knee_angle">', '<Coordinate name="knee_angle"><locked>true</locked>'),
    )
    assert fit(folder / "leg.osim", MARKERS[:5]).undetermined == ()


def test_a_coupled_joint_is_determined_by_the_other(tmp_path: Path) -> None:
    folder = copy_lab("unseen", tmp_path)
    coupler = """<CoordinateCouplerConstraint name="both"><coupled_coordinates_function><LinearFunction name="f">
    <coefficients>-1 0</coefficients></LinearFunction></coupled_coordinates_function><independent_coordinate_names>
    hip_flexion</independent_coordinate_names><dependent_coordinate_name>knee_angle</dependent_coordinate_name>
    </CoordinateCouplerConstraint>"""
    change(folder / "leg.osim", ("<ConstraintSet><objects>", f"<ConstraintSet><objects>{coupler}"))
    assert fit(folder / "leg.osim", MARKERS[:5]).undetermined == ()
    assert set(fit(folder / "leg.osim", MARKERS[:3]).undetermined) == {"hip_flexion", "knee_angle"}


def test_a_motion_of_one_frame() -> None:
    data = MarkerData.from_source(LABS / "unseen" / "walk.trc")
    arrays = {
        name: data.positions[:1, place]
        for place, name in enumerate(data.names)
        if name in MARKERS[:5]
    }
    motion = osimlite.inverse_kinematics(
        osimlite.read(LABS / "unseen" / "leg.osim"), arrays, times=data.times[:1]
    )
    assert motion.undetermined == ("knee_angle",)
    assert np.isfinite(motion.values).all()


def test_the_summary_of_a_setup_names_undetermined_coordinates(tmp_path: Path) -> None:
    fixtures = Path(__file__).parents[2] / "fixtures" / "setups"
    for name in ("scale.xml", "markers.xml", "walk.trc"):
        shutil.copy(fixtures / name, tmp_path)
    (tmp_path / "model.osim").write_bytes(
        gzip.decompress((fixtures / "model.osim.gz").read_bytes())
    )
    lines = run("run", "scale.xml", folder=tmp_path).out.splitlines()
    (line,) = [line for line in lines if "no measurement determines" in line]
    assert line.startswith("coordinates ")
    assert any(line.startswith("mass ") and "to 72.6 kg" in line for line in lines)
