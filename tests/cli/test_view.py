"""Tests of ``view`` on the command line."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

import osimlite
from osimlite.cli import main
from osimlite.io.tables.storage import write_sto
from osimlite.models.dynamic_walker import dynamic_walker
from tests.view.motions import stroll


@pytest.fixture
def walker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    osimlite.write(dynamic_walker(), tmp_path / "walker.osim")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*arguments: str) -> int:
    with pytest.raises(SystemExit) as left:
        main(["view", *arguments])
    return int(left.value.code or 0)


def test_a_page_and_a_picture_are_written(walker: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("PIL", reason="needs pillow (extra 'view')")
    motion = stroll()
    write_sto(walker / "walk.sto", "walk", motion.times, motion.coordinates, motion.values.tolist())
    code = run(
        "walker.osim", "walk.sto", "--html", "out/page.html", "--screenshot", "a.png", "--at", "0.2"
    )
    assert code == 2 and "out" in capsys.readouterr().err
    assert (
        run(
            "walker.osim", "walk.sto", "--html", "page.html", "--screenshot", "a.png", "--at", "0.2"
        )
        == 0
    )
    assert re.search(r"wrote page\.html \(0\.\d MB\)\nwrote a\.png", capsys.readouterr().out)
    assert (walker / "page.html").stat().st_size > 500_000 and (walker / "a.png").read_bytes()[
        1:4
    ] == b"PNG"


def test_coordinates_can_be_set(walker: Path) -> None:
    assert run("walker.osim", "--set", "RKnee_rz=-30deg", "--html", "page.html") == 0
    result = re.search(r'"q":\[([^]]*)\]', (walker / "page.html").read_text())
    assert result and "-0.523598775598298" in result[1]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("nowhere.osim",), "nowhere.osim"),
        (("walker.osim", "nowhere.sto", "--html", "a.html"), "nowhere.sto"),
        (("walker.osim", "--geometry", "nowhere"), "--geometry names a folder"),
        (("walker.osim", "--set", "RKnee=1", "--html", "a.html"), "RKnee_rz"),
        (("walker.osim", "--glb", "a.html"), "--glb writes a file whose name ends with .glb"),
        (
            ("walker.osim", "--at", "1", "--screenshot", "a.png"),
            "a time was given without a motion",
        ),
    ],
)
def test_what_cannot_be_shown_is_said(
    arguments: tuple[str, ...], said: str, walker: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*arguments) == 2
    assert said in capsys.readouterr().err
    assert not list(walker.glob("a.*"))


@pytest.mark.skipif(os.name == "nt", reason="sends signals")
def test_the_page_is_served_until_interrupted(walker: Path) -> None:
    command = [sys.executable, "-u", "-m", "osimlite", "view", "walker.osim", "--no-browser"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as served:
        try:
            assert served.stdout is not None and served.stderr is not None
            line = served.stdout.readline()
            (url,) = re.findall(r"http://127\.0\.0\.1:\d+/", line)
            with urllib.request.urlopen(url) as page:
                assert "DynamicWalkerModel" in page.read().decode()
            served.send_signal(signal.SIGINT)
            assert served.wait(20) == 130
            assert "Traceback" not in served.stderr.read()
        finally:
            served.kill()


def test_columns_that_do_not_move_the_model_are_named(
    fixtures: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lab = fixtures / "labs" / "locked"
    text = (lab / "walk.mot").read_text()
    (tmp_path / "walk.mot").write_text(text.replace("knee_angle", "kne_angle"))
    page = str(tmp_path / "page.html")
    assert run(str(lab / "leg.osim"), str(tmp_path / "walk.mot"), "--html", page) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[:2] == [
        "not in the motion, default value used: knee_angle",
        "ignored columns (no coordinate, or a repeated one): kne_angle",
    ]
    # A coordinate that the user sets, by name or by path, has no default value.
    for name in ("knee_angle", "/jointset/knee/knee_angle"):
        files = str(lab / "leg.osim"), str(tmp_path / "walk.mot")
        assert run(*files, "--set", f"{name}=10deg", "--html", page) == 0
        assert "default value used" not in capsys.readouterr().out
    (tmp_path / "walk.mot").write_text(text)
    assert run(str(lab / "leg.osim"), str(tmp_path / "walk.mot"), "--html", page) == 0
    assert capsys.readouterr().out.startswith("wrote ")
