"""Tests of ``gait``: options, exit codes and messages."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import osimlite
from osimlite.cli import main
from tests.simple_models import make_pendulum


def run(*words: str) -> int:
    try:
        main(["gait", *words])
    except SystemExit as end:
        return int(end.code or 0)
    return 0


@pytest.fixture
def file(tmp_path: Path) -> str:
    return str(tmp_path / "model.osim")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--perturb", "-1"], "--perturb must be a positive number, not -1"),
        (["--to", "0"], "--to must be a positive number, not 0"),
        (["--reach", "nan"], "--reach must be a positive number, not nan"),
        (["--seed", "-1"], "the seed must be a whole number of at least 0, not -1"),
        (["-p", "slop=2"], "no parameter 'slop'; did you mean 'slope'"),
        (["-o", __file__], "this is a file, not a folder"),
        (["--basin-x", "UNKNOWN"], "has no coordinate 'UNKNOWN'"),
        (["--basin-x", "RHip_r"], "did you mean 'RHip_rz'? (see docs/gaits.md"),
        (["--basin-y", "RHip_rz/sped"], "RHip_rz/sped"),
        (["--basin-x", "RHip_rz", "--basin-y", "RHip_rz"], "are the same variable"),
    ],
)
def test_options_are_checked_before_the_walk(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def walked(*_: object) -> None:
        raise AssertionError("it walked")

    monkeypatch.setattr("osimlite.cli.gait.simulate_walk", walked)
    assert run("dynamic-walker", *words) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1


def test_without_a_cycle_the_steps_are_counted_and_the_answer_is_no(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        run("dynamic-walker", "-p", "slope=8", "--to", "1", "--basin", "-o", str(tmp_path / "gait"))
        == 1
    )
    assert "makes no step" in " ".join(capsys.readouterr().out.split())
    facts = json.loads((tmp_path / "gait" / "gait.json").read_text())
    assert facts["walk"]["steps"] == [] and facts["walk"]["ending"] == "fell"
    assert facts["cycle"] is None and "makes no step" in facts["why_no_cycle"]
    assert [path.name for path in (tmp_path / "gait").iterdir()] == ["gait.json"]


def test_what_cannot_walk_leaves_no_folder(tmp_path: Path, file: str) -> None:
    osimlite.write(make_pendulum(), file)
    assert run(file, "-o", str(tmp_path / "gait")) == 2
    assert not (tmp_path / "gait").exists()


def test_parameters_are_of_functions_only(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    osimlite.write(make_pendulum(), file)
    assert run(file, "-p", "slope=8") == 2
    assert "has no parameters" in capsys.readouterr().err


def test_without_contacts(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    osimlite.write(make_pendulum(), file)
    assert run(file) == 2
    assert "'pendulum' has no contact forces" in capsys.readouterr().err


def test_what_cannot_be_computed_can_be_left_out(
    file: str, capsys: pytest.CaptureFixture[str]
) -> None:
    model = make_pendulum()
    for number in range(6):
        model.add(osimlite.ElasticFoundationForce(name=f"foundation{number}", appliesForce=True))
    text = osimlite.to_text(model).replace("ElasticFoundationForce", "MyOwnForce")
    Path(file).write_text(text)
    assert run(file) == 1
    error = capsys.readouterr().err
    assert "6 of MyOwnForce" in error and "--skip-unsupported" in error
    assert run(file, "--skip-unsupported") == 2
    assert "has no contact forces" in capsys.readouterr().err


def test_constraints_are_beyond_the_search_for_gaits(
    file: str, capsys: pytest.CaptureFixture[str]
) -> None:
    model = make_pendulum()
    body = next(iter(model.components(osimlite.Body)))
    model.add(
        osimlite.PointConstraint(name="held", socket_body_1="/ground", socket_body_2=body.path)
    )
    osimlite.write(model, file)
    assert run(file) == 1
    error = capsys.readouterr().err
    assert (
        "constraints or prescribed coordinates: /constraintset/held" in error
        and "take the engine" not in error
    )
