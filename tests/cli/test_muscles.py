"""Tests of ``muscles``: output, files and error messages."""

from __future__ import annotations

import csv

import numpy as np
import pytest

import osimlite
from osimlite import Model
from osimlite.models.dynamic_walker import dynamic_walker
from tests.cli.command import run
from tests.simulation.elements.muscle_rows import hung, muscle


@pytest.fixture
def file(tmp_path, monkeypatch):
    """Write a model of a muscle between ground and a block on a slider; the path length equals the coordinate."""
    monkeypatch.chdir(tmp_path)
    model: Model = hung(muscle("thelen_default"))
    model.find("/jointset/slide/x").range = (0.3, 0.36)
    model.find("/jointset/slide/x").default_value = 0.33
    osimlite.write(model, "arm.osim")
    model.find("/forceset/mu").max_isometric_force *= 2.0
    osimlite.write(model, "strong.osim")
    return tmp_path / "arm.osim"


def test_the_default_pose(file):
    told = run("muscles", "arm.osim")
    assert told.code == 0
    assert told.out.splitlines()[1].split()[:2] == ["mu", "330.0"]


def test_a_coordinate_is_swept_over_its_range_and_written(file):
    told = run("muscles", "arm.osim", "--coordinate", "x", "--points", "7", "-o", "arm.csv")
    assert told.code == 0
    assert "300.0 to 360.0" in told.out and "-1000.0" in told.out
    with open("arm.csv") as text:
        rows = list(csv.DictReader(text))
    assert [float(row["x"]) for row in rows] == pytest.approx(np.linspace(0.3, 0.36, 7))
    assert {row["muscle"] for row in rows} == {"/forceset/mu"}
    for row in rows:
        assert float(row["length"]) == pytest.approx(float(row["x"]))
        assert float(row["moment_arm_x"]) == pytest.approx(-1.0)
        both = float(row["active_fiber_force"]) + float(row["passive_fiber_force"])
        assert float(row["tendon_force"]) == pytest.approx(both, abs=1e-5)


def test_two_models_side_by_side(file):
    told = run(
        "muscles",
        "arm.osim",
        "--coordinate",
        "x=0.31:0.34",
        "--compare",
        "strong.osim",
        "-o",
        "both.csv",
    )
    assert told.code == 0
    assert "Largest differences of strong.osim from arm.osim" in told.out
    with open("both.csv") as text:
        rows = list(csv.DictReader(text))
    forces = {
        name: np.array([float(row["tendon_force"]) for row in rows if row["model"] == name])
        for name in ("arm.osim", "strong.osim")
    }
    assert forces["strong.osim"] == pytest.approx(2.0 * forces["arm.osim"], rel=1e-6)
    largest = float(told.out.splitlines()[-2].split()[-1])
    assert largest == pytest.approx(forces["arm.osim"].max(), abs=0.6)


def test_pictures(file):
    pytest.importorskip("matplotlib", reason="needs matplotlib (extra 'plot')")
    told = run("muscles", "arm.osim", "--coordinate", "x", "--compare", "strong.osim", "--plot")
    assert told.code == 0
    pictures = {path.name for path in (file.parent / "arm-muscles").iterdir()}
    assert {"moment_arm_x.png", "tendon_force.png", "length.png"} <= pictures
    assert all(
        (file.parent / "arm-muscles" / name).read_bytes()[:4] == b"\x89PNG" for name in pictures
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--coordinate", "y"), "--coordinate: 'one' has no coordinate 'y'; it has x"),
        (("--coordinate", "x=1"), "--coordinate takes NAME=LOW:HIGH"),
        (("--coordinate", "x=2:1"), "the lower end of the range first"),
        (("--muscle", "/forceset/mo"), "no muscle '/forceset/mo'; did you mean '/forceset/mu'"),
        (("-o", "arm.txt"), ".csv or .parquet"),
        (("--plot",), "--plot needs a --coordinate"),
        (("--activation", "2"), "from 0 to 1"),
        (("--coordinate", "x", "--coordinate", "x", "--coordinate", "x"), "once or twice"),
        (("--coordinate", "x", "--coordinate", "x=0.31:0.32"), "--coordinate names 'x' twice"),
    ],
)
def test_what_makes_no_sense_is_told(file, words, said):
    told = run("muscles", "arm.osim", *words)
    assert told.code == 2 and said in told.err
    assert {path.name for path in file.parent.iterdir()} == {"arm.osim", "strong.osim"}


def test_degrees_that_are_taken_for_radians_are_refused(file):
    osimlite.write(dynamic_walker(), file.parent / "walker.osim")
    told = run("muscles", "walker.osim", "--coordinate", "RHip_rz=0:30")
    assert told.code == 2 and "did you mean 30deg? (if not, write 30rad)" in told.err


def test_a_model_without_muscles_is_told(file):
    osimlite.write(dynamic_walker(), file.parent / "walker.osim")
    told = run("muscles", "walker.osim", "--coordinate", "RHip_rz")
    assert (
        told.code == 1
        and not told.out
        and "'walker.osim' has no muscle that moves with RHip_rz" in told.err
    )
    assert "'walker.osim' has no muscles" in run("muscles", "walker.osim").err


def test_a_muscle_without_equilibrium_hides_no_other(file):
    model = osimlite.read(file)
    other = model.find("/forceset/mu").copy_deep()
    other.name, other.tendon_slack_length = "slack", 5.0
    model.force_set.objects.append(other)
    curves = osimlite.muscle_curves(model, {"x": [0.32, 0.33]})
    assert curves.muscles == ("/forceset/mu", "/forceset/slack")
    assert np.isfinite(curves.columns["tendon_force"][:, 0]).all()
    assert (curves.columns["length"] > 0.3).all()


def test_a_folder_that_cannot_be_made_is_told_before_the_work(file, tmp_path):
    # The model does not exist: the output folder is checked before it is read.
    (tmp_path / "taken").touch()
    done = run("muscles", tmp_path / "none.osim", "-o", tmp_path / "taken" / "m.csv")
    assert done.code == 2
    assert "cannot make a folder here: this is a file" in done.err


def test_the_folder_of_the_output_is_made(file, tmp_path):
    done = run("muscles", file, "--coordinate", "x=0.3:0.4", "-o", tmp_path / "a" / "b" / "m.csv")
    assert done.code == 0 and (tmp_path / "a" / "b" / "m.csv").is_file()
