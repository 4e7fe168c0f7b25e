"""Test of ``demo``, the tour for newcomers."""

from __future__ import annotations

import json
import re
from importlib.util import find_spec
from pathlib import Path

import pytest

import osimlite
from tests.cli.command import run
from tests.suite import is_full

pytest.importorskip("matplotlib", reason="needs matplotlib (extra 'plot')")


def test_the_whole_tour(tmp_path: Path) -> None:
    # The quick suite leaves out the pictures: .ci/run makes them, and tests/view draws shorter
    # motions.
    pictures = is_full()
    words = () if pictures else ("--no-pictures",)
    done = run("demo", "-o", "out", *words, folder=tmp_path)
    assert (done.code, done.err) == (0, "")
    folder = tmp_path / "out"
    names = ["dynamic-walker", "steady-walker", "jumper", "human-walks"]
    pages = [f"{name}.html" for name in names] if pictures else []
    by_bullet = {"dynamic-walker-bullet"} if find_spec("pybullet") else set()
    assert {path.name for path in folder.iterdir()} == {*names, *pages, *by_bullet}
    walker = folder / "dynamic-walker"
    assert {path.name for path in walker.iterdir()} == {
        "DynamicWalkerModel.osim", "misspelt.osim", "urdf", "states.sto", "forces.sto", "summary.json",
    }  # fmt: skip
    assert osimlite.validate(walker / "DynamicWalkerModel.osim").ok
    assert (folder / "jumper" / "states.png").exists() == pictures
    assert "did you mean 'RFootContact'?" in done.out
    assert max(map(len, done.out.splitlines())) <= 80
    said = " ".join(done.out.split())
    difference = re.search(r"every coordinate stays within (\S+) rad or m of the motion", said)
    assert difference is not None and float(difference[1]) < 1e-4
    if by_bullet:
        apart = re.search(
            r"differs by more than (\S+) rad or m from the motion of osimlite's own engine; "
            r"the integrator took (\d+) steps with PyBullet and (\d+) without it",
            said,
        )
        assert apart is not None and 0.0 < float(apart[1]) < 1e-6 and apart[2] == apart[3]
    else:
        assert "pip install 'osimlite[bullet]'" in said
    # The expected speeds and heights are those of OpenSim's motions and of docs/gaits.md.
    assert "6 steps in 5 s, at 0.83 m/s" in said
    assert "rises from 0.75 to 1.28 m, and nothing touches the ground for 0.42 s" in said
    walked = re.search(r"walks for 10 s at (\S+) m/s, in (\d+) steps, by reflexes alone", said)
    assert walked is not None and 1.1 < float(walked[1]) < 1.4 and 18 <= int(walked[2]) <= 26
    for page in pages:
        (text,) = re.findall(
            r'id="data">(.*?)</script>', (folder / page).read_text(encoding="utf-8")
        )
        story = json.loads(text)["story"]
        assert list(json.loads(text)["motion"]["activations"]) or page != pages[-1]
        assert [file for _, file in story["pages"]] == pages and story["page"] == page
        assert story["words"][:60] in said
