"""Tests of ``ik``, ``scale`` and ``fit`` on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.fitting.marker_data import MarkerData
from osimlite.io.tables.storage import read_sto
from osimlite.io.tables.writers import write_trc
from tests.cli.command import run
from tests.simple_models import make_marked_body

POINTS = {
    "one": (0.1, 0.0, 0.0),
    "two": (0.0, 0.2, 0.0),
    "three": (0.0, 0.0, 0.3),
    "four": (0.1, 0.1, 0.1),
}


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    """Return a folder with a model of a marked body and a trial of its markers."""
    model = make_marked_body(POINTS, "box")
    osimlite.write(model, tmp_path / "box.osim")
    mechanism: Any = osimlite.mechanism(model)
    poses = [0.2 * k * np.array((0.3, -0.2, 0.1, 0.5, 0.6, 0.7)) for k in range(5)]
    rows = [
        [x for p in POINTS.values() for x in mechanism.at(q).point(0, np.array(p)).tolist()]
        for q in poses
    ]
    write_trc(tmp_path / "walk.trc", [0.1 * k for k in range(5)], list(POINTS), rows)
    return tmp_path


def test_a_trial_is_fitted(lab: Path) -> None:
    done = run(
        "ik", "box.osim", "walk.trc", "--weight", "one=10", "--from", "0.1", "-o", "out", folder=lab
    )
    assert (done.code, done.err) == (0, "")
    assert "4 frames, 4 markers: errors of 0.00 cm" in done.out
    table = read_sto(lab / "out" / "ik.mot")
    assert table.in_degrees and table.times == pytest.approx([0.1, 0.2, 0.3, 0.4])
    assert table.rows[-1] == pytest.approx(
        [*np.rad2deg((0.24, -0.16, 0.08)), 0.4, 0.48, 0.56], abs=1e-6
    )
    assert read_sto(lab / "out" / "marker_errors.sto").columns == tuple(POINTS)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("ik", "box.osim", "walk.trc", "--weight", "on=1"), "'box' has no marker 'on'"),
        (
            ("ik", "box.osim", "walk.trc", "--weight", "one=much"),
            "'much' is not a number for 'one'",
        ),
        (
            ("ik", "box.osim", "walk.trc", "--keep", "knee=1"),
            "--keep: 'box' has no coordinate 'knee'",
        ),
        (
            ("ik", "box.osim", "walk.trc", "--keep", "j_coord_0=-5"),
            "the weight -5 of the coordinate 'j_coord_0' is invalid",
        ),
        (("ik", "box.osim", "walk.trc", "--from", "7"), "no frame of 'walk.trc' lies after"),
        (("ik", "box.osim", "none.trc"), "none.trc: cannot read the file"),
        (("ik", "box.osim", "box.osim"), "this is not a marker file"),
        (("scale", "box.osim", "--distance", "b=one:two"), "need markers of the standing subject"),
        (
            ("scale", "box.osim", "walk.trc", "--distance", "b=one"),
            "'one' is not a pair of markers for 'b'",
        ),
        (("scale", "box.osim", "--factor", "b=1,2"), "'1,2' is not a factor for 'b'"),
        (("scale", "box.osim", "--factor", "c=2"), "'box' has no body 'c'"),
        (("scale", "box.osim", "walk.trc", "--distance", "c.X=one:two"), "'box' has no body 'c'"),
        (
            ("scale", "box.osim", "walk.trc", "--distance", "b=one:twoo"),
            "--distance: 'box' has no marker 'twoo'; did you mean 'two'?",
        ),
        (("scale", "box.osim", "walk.trc", "--factor", "b=2"), "'walk.trc' has no effect; add"),
        (("scale", "box.osim", "--mass", "-1"), "--mass: expected a positive mass in kg, found -1"),
        (
            ("scale", "box.osim", "--factor", "b=0"),
            "expected positive factors of 'b', found 0, 0, 0",
        ),
        (
            ("scale", "box.osim", "--factor", "b=1,-2,1"),
            "expected positive factors of 'b', found 1, -2, 1",
        ),
        (
            ("scale", "box.osim", "walk.trc", "--distance", "b.XQ=one:two"),
            "'XQ' of 'b' are not axes",
        ),
    ],
)
def test_what_is_wrong_is_told(lab: Path, words: tuple[str, ...], said: str) -> None:
    done = run(*words, folder=lab)
    assert done.code in (1, 2) and said in done.err, done.err
    assert sorted(path.name for path in lab.iterdir()) == ["box.osim", "walk.trc"]


def test_a_measured_marker_that_is_missing_is_an_error(lab: Path) -> None:
    """OpenSim's setups skip such a measurement; the command names it, and writes nothing."""
    trial = lab / "walk.trc"
    trial.write_text(trial.read_text().replace("two", "tow"))
    done = run("scale", "box.osim", "walk.trc", "--distance", "b=one:two", folder=lab)
    assert done.code == 2 and "the data have no marker 'two'; did you mean 'tow'?" in done.err
    assert sorted(path.name for path in lab.iterdir()) == ["box.osim", "walk.trc"]


def test_markers_that_do_not_count_and_units_that_cannot_be_right_are_told(lab: Path) -> None:
    trial = lab / "walk.trc"
    trial.write_text(trial.read_text().replace("three", "threee"))
    out = run("ik", "box.osim", "walk.trc", "-o", "out", folder=lab).out
    assert (
        "in the model, but not in the data: three\n" in out
        and "in the data, but not in the model: threee\n" in out
    )
    assert "units" not in out
    data = MarkerData.from_source(trial)
    write_trc(
        trial,
        data.times.tolist(),
        data.names,
        (1000.0 * data.positions).reshape(len(data.times), -1).tolist(),
    )
    assert (
        "check the units of the data"
        in run("ik", "box.osim", "walk.trc", "-o", "out", folder=lab).out
    )


def test_a_model_is_scaled(lab: Path) -> None:
    done = run(
        "scale",
        "box.osim",
        "walk.trc",
        "--distance",
        "b.XY=one:two",
        "--mass",
        "3",
        "--place",
        folder=lab,
    )
    assert (
        (done.code, done.err) == (0, "")
        and "b.XY: 1" in done.out
        and "wrote scaled.osim" in done.out
    )
    model = osimlite.read(lab / "scaled.osim")
    assert model["/bodyset/b"].mass == pytest.approx(3.0)
    done = run("scale", "box.osim", "--factor", "b=2,1,1", "-o", "long.osim", folder=lab)
    assert done.code == 0 and osimlite.read(lab / "long.osim")["/markerset/one"].location == (
        0.2,
        0.0,
        0.0,
    )


def test_a_mass_in_grams_is_doubted(lab: Path) -> None:
    for mass, is_doubted in (("2", False), ("2000", True)):
        done = run("scale", "box.osim", "--mass", mass, folder=lab)
        assert done.code == 0 and f"mass: scaled from 1 to {mass} kg" in done.out
        assert ("is the mass of the subject in kg?" in done.out) == is_doubted


def test_a_model_is_fitted_to_a_person(lab: Path) -> None:
    """Markers of --hold keep their positions; the written setup reproduces the model."""
    done = run(
        "fit",
        "box.osim",
        "walk.trc",
        "--hold",
        "one",
        "--hold",
        "two",
        "--mass",
        "3",
        "-o",
        "out",
        folder=lab,
    )
    assert (done.code, done.err) == (0, "")
    assert "b: 1.0000 ±" in done.out and "walk.trc: errors of 0.00 cm" in done.out
    model = osimlite.read(lab / "out" / "box_fitted.osim")
    assert model.body_set.objects[0].mass == pytest.approx(3.0)
    assert {path.name for path in (lab / "out").iterdir()} == {
        "box_fitted.osim", "markers.xml", "markers_unscaled.xml", "scale_set.xml", "setup_scale.xml"
    }  # fmt: skip
    assert run("run", "setup_scale.xml", folder=lab / "out").code == 0


def test_trials_of_two_folders_may_have_one_name(lab: Path) -> None:
    """Each trial is fitted and reported."""
    (lab / "second").mkdir()
    (lab / "second" / "walk.trc").write_bytes((lab / "walk.trc").read_bytes())
    done = run("fit", "box.osim", "walk.trc", "second/walk.trc", "-o", "out", folder=lab)
    assert (
        done.code == 0
        and "\nwalk.trc: errors" in done.out
        and "walk.trc: errors" in done.out.partition("second")[2]
    )


def test_a_marker_that_is_not_there_cannot_be_held(lab: Path) -> None:
    """The message suggests the nearest name, and nothing is written."""
    done = run("fit", "box.osim", "walk.trc", "--hold", "on", "-o", "out", folder=lab)
    assert done.code != 0 and "one" in done.err and not (lab / "out").exists()


def test_markers_that_placing_removes_are_named(lab: Path) -> None:
    trial = lab / "walk.trc"
    trial.write_text(trial.read_text().replace("three", "other"))
    done = run("scale", "box.osim", "walk.trc", "--place", folder=lab)
    assert (done.code, done.err) == (0, "")
    assert "because the data lack them: three" in " ".join(done.out.split())


def test_a_measured_factor_that_a_given_one_replaces_is_marked(lab: Path) -> None:
    options = ("--distance", "b=one:two", "--factor", "b=2")
    done = run("scale", "box.osim", "walk.trc", *options, folder=lab)
    assert done.code == 0 and "b: 1, not used because of --factor" in done.out
    factor = osimlite.read(lab / "scaled.osim")["/markerset/one"].location[0]
    assert factor == pytest.approx(2.0 * POINTS["one"][0])
