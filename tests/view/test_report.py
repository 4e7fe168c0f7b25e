"""Tests of reports of trials: steps from forces, contents of the plots, and a page without external files."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="needs matplotlib (extra 'plot')")

import osimlite
from osimlite.errors import OsimliteError
from osimlite.io.tables.storage import write_sto
from osimlite.mechanics.multibody import build_mechanism
from osimlite.tools.evidence import find_root_coordinates, find_steps, split_side
from osimlite.tools.outcome import Outcome
from osimlite.tools.report import report
from osimlite.tools.trial_curves import TrialOutcomes, collect_angles, collect_moments
from tests.cli.command import run
from tests.fitting.support import free_body
from tests.tools.support import make_trial

FORCE = """<ExternalForce name="{side}"><applied_to_body>calcn_{side}</applied_to_body>
<force_expressed_in_body>ground</force_expressed_in_body><force_identifier>{side}_v</force_identifier></ExternalForce>"""


@pytest.fixture
def loads(tmp_path: Path) -> Path:
    """Write loads of two feet with a stance of 0.6 s per second, and one sample of noise."""
    times = np.arange(0.0, 3.0, 0.01)
    columns, rows = [], []
    for side, start in (("r", 0.25), ("l", 0.75)):
        force = np.where((times - start) % 1.0 < 0.6, 700.0, 0.0)
        force[times < start] = 0.0
        force[150] = 700.0 - force[150]
        columns += [f"{side}_v{axis}" for axis in "xyz"]
        rows += [0.0 * force, force, 0.0 * force]
    write_sto(tmp_path / "grf.mot", "grf", times.tolist(), columns, np.array(rows).T.tolist())
    forces = "".join(FORCE.format(side=side) for side in "rl")
    text = f'<ExternalLoads name="l"><objects>{forces}</objects><datafile>grf.mot</datafile></ExternalLoads>'
    (tmp_path / "loads.xml").write_text(
        f'<OpenSimDocument Version="40600">{text}</OpenSimDocument>'
    )
    return tmp_path / "loads.xml"


def test_steps_are_where_the_force_begins_and_ends(loads: Path) -> None:
    steps = find_steps(loads, 1)
    assert steps["r"].strikes == pytest.approx((0.25, 1.25, 2.25), abs=0.0101)
    assert steps["r"].offs == pytest.approx((0.85, 1.85, 2.85), abs=0.0101)
    assert (
        steps["l"].strikes == pytest.approx((0.75, 1.75, 2.75), abs=0.0101)
        and len(steps["l"].offs) == 2
    )
    assert len(steps["r"].cycles) == 2
    assert find_steps(loads, 0)["r"].strikes == ()


def test_sides_and_roots() -> None:
    names = ["knee_angle_r", "r_knee_angle", "knee_angle_l", "lumbar", "r"]
    assert [split_side(name) for name in names] == [("knee_angle", "r")] * 2 + [
        ("knee_angle", "l"), ("lumbar", ""), ("r", ""),
    ]  # fmt: skip
    assert find_root_coordinates(build_mechanism(free_body())) == tuple(range(6))


@pytest.fixture
def trials(tmp_path: Path) -> Path:
    """Write two trials of a model whose name must be escaped in HTML."""
    model = free_body()
    model.name = 'a <b>"model"'
    osimlite.write(model, tmp_path / "model.osim")
    for seed in range(2):
        make_trial(tmp_path / f"trial{seed}", seed)
    return tmp_path


def data_of(page: str) -> list[dict[str, Any]]:
    """Return the data of all viewers in a page."""
    inner = [html.unescape(text) for text in re.findall(r'srcdoc="([^"]*)"', page)]
    result = [
        re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)
        for text in inner
    ]
    return [json.loads(match[1]) for match in result if match]


def test_a_page_for_two_trials_needs_nothing_else(trials: Path) -> None:
    words = [f"trial{k}/{name}.xml" for k in range(2) for name in ("id", "z_ik")]
    done = run("run", *words, "--report", "report.html", "--resume", folder=trials)
    assert done.code == 2 and "one after the other" in done.err
    done = run("run", *words, "--report", "report.html", folder=trials)
    assert done.code == 0 and "wrote report.html" in done.out
    page = (trials / "report.html").read_text()
    assert "<h2>trial0</h2>" in page and "Marker errors: trial1" in page and "Joint angles" in page
    outside = re.sub(r'srcdoc="[^"]*"', "", page)
    assert not re.findall(r'(?:src|href)="(?!data:)', outside) and "<script" not in outside
    viewers = data_of(page)
    assert [viewer["name"] for viewer in viewers] == ['a <b>"model"'] * 2
    # The report is about the motion: it leaves out findings of the model.
    assert osimlite.validate(trials / "model.osim").findings
    assert [viewer["findings"] for viewer in viewers] == [[], []]
    measured = viewers[0]["motion"]["measured"]
    assert [marker["name"] for marker in measured["markers"]] == ["one", "two", "three", "four"]


def test_a_page_says_what_the_results_are_worth(trials: Path) -> None:
    """The numbers come from this run, wherever it wrote its results, and not from older files near the setups."""
    words = [f"trial0/{name}.xml" for name in ("z_ik", "id")]
    assert run("run", *words, folder=trials).code == 0
    left = next(path for path in (trials / "trial0").glob("*.mot"))
    left.write_text(left.read_text().replace("0.", "9.", 40))
    results = {name: osimlite.run(trials / name, trials / "elsewhere") for name in words[:1]}
    path = report(
        {trials / name: outcome for name, outcome in results.items()}, trials / "worth.html"
    )
    part = path.read_text().partition("Is it good enough?")[2]
    assert "the peak of the errors of the markers" in part and '<td class="good">good</td>' in part
    assert "OpenSim&#x27;s best practices" in part
    largest = 100.0 * results[words[0]].summary["largest_marker_error"]
    assert f"{largest:.3g} cm" in part or "&lt;0.001 cm" in part


@pytest.mark.full
def test_a_setup_that_fails_stops_no_report(trials: Path) -> None:
    (trials / "trial0" / "trial.trc").unlink()
    words = [f"trial{k}/{name}.xml" for k in range(2) for name in ("id", "z_ik")]
    done = run("run", *words, "--report", "report.html", folder=trials)
    assert (
        done.code == 2
        and "4 setups: 2 done, 1 failed, 1 not run" in done.out
        and "wrote report.html" in done.out
    )
    assert "<h1>trial1</h1>" in (trials / "report.html").read_text()


def test_a_report_that_has_no_place_is_told_before_anything_is_run(trials: Path) -> None:
    (trials / "no").touch()
    done = run("run", "trial0/z_ik.xml", "--report", "no/report.html", folder=trials)
    assert done.code == 2 and "cannot make a folder here: this is a file" in done.err
    assert not (trials / "trial0" / "ik.mot").exists()


def test_one_call_leaves_the_next_one_possible(trials: Path) -> None:
    """Importing the module `report` must not replace the function of that name in the package."""
    outcomes: dict[str | Path, Outcome] = {"ik.xml": osimlite.run(trials / "trial0" / "z_ik.xml")}
    for name in ("one.html", "two.html"):
        assert osimlite.report(outcomes, trials / name) == trials / name
        assert (trials / name).is_file()


def test_what_is_drawn_are_the_tables(trials: Path, loads: Path) -> None:
    folder = trials / "trial0"
    outcomes: list[Outcome] = [osimlite.run(folder / "z_ik.xml"), osimlite.run(folder / "id.xml")]
    trial = TrialOutcomes("trial0", outcomes)
    panels = collect_angles([trial])
    table = outcomes[0].tables["ik.mot"]
    drawn = {label.removesuffix(" (deg)"): lines[0].column for label, lines in panels.items()}
    assert drawn and all(
        np.allclose(column, table[name], atol=1e-9) for name, column in drawn.items()
    )
    # The only joint connects to ground, and its forces are residuals, not moments.
    assert collect_moments([trial]) == {} and trial.evidence is outcomes[0].evidence
    assert outcomes[1].evidence is not None and outcomes[1].evidence.loads is None


def test_nothing_to_report_is_told(tmp_path: Path) -> None:
    with pytest.raises(OsimliteError, match="no setup has a motion"):
        report({"scale.xml": Outcome()}, tmp_path / "report.html")


def test_a_report_of_muscle_forces_has_them_and_names_its_tools(tmp_path: Path) -> None:
    from tests.labs import copy_lab

    copy_lab("unbalanced", tmp_path)
    done = run("run", "so.xml", "--report", "so.html", folder=tmp_path)
    page = (tmp_path / "so.html").read_text()
    assert done.code in (0, 1), done.err
    assert "AnalyzeTool, so.xml" in page
    for title in ("Muscle activations", "Muscle forces"):
        assert f"<h2>{title}</h2>" in page


def test_activations_of_a_tool_color_the_muscles(tmp_path: Path) -> None:
    from osimlite.tools.trial_curves import collect_trials, read_muscle_states
    from tests.labs import copy_lab

    copy_lab("unbalanced", tmp_path)
    outcome = osimlite.run(tmp_path / "so.xml")
    (trial,) = collect_trials({tmp_path / "so.xml": outcome})
    states = read_muscle_states(trial)
    assert states and all(label.endswith(".activation") for label in states)
    assert trial.evidence is not None
    assert {len(column) for column in states.values()} == {len(trial.evidence.times)}
