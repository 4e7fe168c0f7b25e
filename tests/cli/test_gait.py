"""``osimlite gait``: what it says before it walks."""

from __future__ import annotations

from pathlib import Path

import pytest

import osimlite
from osimlite.cli import main

pytest.importorskip("numba", reason="needs numba (extra 'fast')")


def run(*words: str) -> int:
    try:
        main(["gait", *words])
    except SystemExit as end:
        return int(end.code or 0)
    return 0


@pytest.fixture
def file(tmp_path: Path) -> str:
    return str(tmp_path / "model.osim")


def pendulum() -> osimlite.Model:
    model = osimlite.Model(name="pendulum")
    bob = model.add(osimlite.Body(name="bob", mass=1.0, inertia=[1, 1, 1, 0, 0, 0]))
    model.add(osimlite.PinJoint(name="pin").between(model.ground, bob))
    return model


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--perturb", "-1"], "--perturb is a positive number, not -1"),
        (["--to", "0"], "--to is a positive number, not 0"),
        (["--reach", "nan"], "--reach is a positive number, not nan"),
        (["--basin-x", "UNKNOWN"], "UNKNOWN"),
        (["--basin-y", "RHip_rz/sped"], "RHip_rz/sped"),
    ],
)
def test_options_are_checked_before_the_walk(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def walked(*_: object) -> None:
        raise AssertionError("it walked")

    monkeypatch.setattr("osimlite.cli.gait._walk", walked)
    assert run("dynamic-walker", *words) in (1, 2)
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1


def test_without_contacts(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    osimlite.write(pendulum(), file)
    assert run(file) == 2
    assert "'pendulum' has no contact forces" in capsys.readouterr().err


def test_what_cannot_be_computed_can_be_left_out(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    model = pendulum()
    for number in range(6):
        model.add(osimlite.ElasticFoundationForce(name=f"foundation{number}", appliesForce=True))
    text = osimlite.to_text(model).replace("ElasticFoundationForce", "MyOwnForce")
    Path(file).write_text(text)
    assert run(file) == 1
    error = capsys.readouterr().err
    assert "6 of MyOwnForce" in error and "--skip-unsupported" in error
    assert run(file, "--skip-unsupported") == 2
    assert "has no contact forces" in capsys.readouterr().err


def test_constraints_are_beyond_the_search_for_gaits(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    model = pendulum()
    body = next(iter(model.components(osimlite.Body)))
    model.add(osimlite.PointConstraint(name="held", socket_body_1="/ground", socket_body_2=body.path))
    osimlite.write(model, file)
    assert run(file) == 1
    error = capsys.readouterr().err
    assert "some of which /constraintset/held takes away" in error and "take the engine" not in error
