"""Tests of the predicted walk of the built-in human: speed, gait and energy are in the ranges of measured walking."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.base.records import replace
from osimlite.cli import main
from osimlite.optimal.simulation_check import check_by_simulation
from osimlite.tools.job import Job
from osimlite.tools.moco_tools import report_solution
from osimlite.tools.outcome import Outcome
from osimlite.tools.trial_curves import collect_contacts, collect_controls, collect_trials
from osimlite.view.motion import contact_forces
from osimlite.view.recording import read_recording

WEIGHT = 75.0 * 9.80665


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """Return the folder of the study and its solution on a coarse mesh."""
    folder = tmp_path_factory.mktemp("walk")
    with pytest.raises(SystemExit) as done:
        main(["build", "human-walks", "-o", str(folder / "human-walks.osim")])
    assert not done.value.code
    study = osimlite.read_document(folder / "human-walks.omoco")
    study.solver.num_mesh_intervals, study.solver.optim_convergence_tolerance = 16, 1e-2
    return folder, osimlite.moco.solve(study, folder=folder)


@pytest.mark.full
def test_it_walks_as_fast_as_it_is_told(walk):
    folder, found = walk
    assert found.success
    mechanism, states = osimlite.mechanism(osimlite.read(folder / "human-walks.osim")), found.states
    ends = [[states[f"{info.path}/value"][k] for info in mechanism.coordinates] for k in (0, -1)]
    way = np.linalg.norm(np.subtract(*(mechanism.center_of_mass(q) for q in ends)))
    assert way / states.times[-1] == pytest.approx(1.2, abs=1e-4)


def test_the_second_step_mirrors_the_first(walk):
    _, found = walk
    columns, half = found.stride.columns, len(found.states.times) - 1
    for name, column in columns.items():
        if name.endswith("pelvis_tx/value"):
            assert np.diff(column).min() > 0.0
            assert column[-1] == pytest.approx(2.0 * column[half])
            continue
        other = re.sub(r"_([rl])(?=/|$)", lambda side: "_l" if side[1] == "r" else "_r", name)
        np.testing.assert_allclose(
            column[half:], columns[other][: half + 1], rtol=0.0, atol=2e-3, err_msg=name
        )
        assert column[-1] == pytest.approx(column[0], abs=2e-3)


def test_the_ground_pushes_in_two_humps(walk):
    folder, found = walk
    found.stride.write(folder / "stride.sto")
    model = osimlite.read(folder / "human-walks.osim")
    motion = read_recording(model, osimlite.mechanism(model), folder / "stride.sto")
    up = sum(
        each.vectors[:, 1]
        for each in contact_forces(motion)
        if each.frame == "Sphere" and each.element.startswith("foot_r")
    )
    up = up / WEIGHT
    assert np.trapezoid(up, motion.times) / motion.times[-1] == pytest.approx(0.5, abs=0.02)
    assert 0.5 < np.mean(up > 0.02) < 0.65
    # The stride is periodic, so its end continues at its beginning.
    strike = np.flatnonzero((up[1:] > 0.05) & (up[:-1] <= 0.05))[-1] + 1
    stance = np.concatenate([up[strike:-1], up[:strike]])
    stance = stance[: np.flatnonzero(stance < 0.02)[0]]
    third = len(stance) // 3
    first, valley, second = (
        stance[:third].max(),
        stance[third : 2 * third].min(),
        stance[third:].max(),
    )
    assert first > 1.1 and second > 1.0 and valley < 0.9


def test_it_takes_as_much_energy_as_people(walk):
    """Measured walking costs about 3.3 J/(kg m)."""
    folder, found = walk
    model, motion = osimlite.read(folder / "human-walks.osim"), found.trajectory
    initial = {name: float(motion.columns[name][0]) for name in motion.names["states"]}
    trajectory = osimlite.simulate(
        model, to=motion.times[-1], initial=initial, controls=found.controls, accuracy=1e-5
    )
    (power,) = trajectory.probes.values()
    assert 3.0 < np.trapezoid(power, trajectory.times) / trajectory.times[-1] / 1.2 / 75.0 < 4.2


def test_standard_output_gets_the_model_alone(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit):
        main(["build", "human-walks", "-o", "-"])
    assert '<Model name="human-walks">' in capfd.readouterr().out
    assert not [*Path().iterdir()]


@pytest.mark.full
def test_a_report_shows_what_was_found(walk):
    """The report lists goals, controls, ground reactions, and how long a simulation stays near the solution."""
    folder, found = walk
    file = folder / "human-walks.omoco"
    outcome, problem = Outcome(), osimlite.moco.build_problem(file)
    report_solution(Job(problem.study, file, simulates=True), problem, found, outcome)
    told = dict(outcome.messages)
    assert {"effort", "roughness", "objective"} <= {*told}
    near = re.fullmatch(
        r"within 0\.01 rad or m of the solution until (\S+) s of (\S+) s; the largest difference at the end is \S+, of '\w+'",
        told["simulated"],
    )
    assert near is not None
    # On such a coarse mesh the simulation stays near the solution only for a while.
    assert (
        0.03 < float(near[1]) <= float(near[2]) == pytest.approx(found.states.times[-1], rel=1e-3)
    )
    page = osimlite.report({file: outcome}, folder / "page.html").read_text(encoding="utf-8")
    assert [title for title in re.findall("<h2>(.+?)</h2>", page) if title != "Joint angles"] == [
        "Controls",
        "Contact forces",
    ]
    (frame,) = re.findall('srcdoc="(.+?)"', page, re.S)
    assert "foot_r_heel_r" in frame and "soleus_r" in frame
    (trial,) = collect_trials({file: outcome})
    up = {line.side: line.column for line in collect_contacts([trial])["along y (N)"]}
    assert {*up} == {"r", "l"}
    stride = found.stride.times
    assert np.trapezoid(up["r"] + up["l"], stride) / stride[-1] == pytest.approx(WEIGHT, rel=0.03)
    assert {*collect_controls([trial])} == {
        name.rpartition("/")[2][:-2] for name in found.controls.columns
    }


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"parameters": {"mass": 1.0}}, "has parameters"),
        ({"times": np.linspace(0.5, 1.0, 3)}, "begins at 0.5 s"),
    ],
)
def test_what_is_not_simulated(change, said, walk):
    folder, found = walk
    with pytest.raises(osimlite.OsimliteError, match=said):
        check_by_simulation(
            osimlite.moco.build_problem(folder / "human-walks.omoco"),
            replace(found.trajectory, **change),
        )
