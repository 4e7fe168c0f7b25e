"""Compare inverse kinematics and scaling with a live OpenSim's tools."""

from __future__ import annotations

import gzip
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.fitting.ik_tool import collect_targets, run_inverse_kinematics
from osimlite.fitting.inverse_kinematics import find_marker_stations
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.person_files import SETUP, UNSCALED, create_person_files
from osimlite.fitting.pose_layout import MarkerTarget
from osimlite.fitting.scaling import scale_model
from osimlite.io.tables.storage import read_sto
from osimlite.io.tables.writers import write_trc
from tests.fitting.support import (
    HELD,
    assert_same,
    cost_of,
    marked,
    person,
    poses,
    trial_of,
    turner,
)
from tests.oracle.support import ask, model_with
from tests.tools.support import unpacked

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

# Script that scales a model with OpenSim.
SCALE = """
import json, sys, opensim
opensim.Logger.setLevelString("Off")
model = opensim.Model("model.osim")
state, factors = model.initSystem(), opensim.ScaleSet()
for name, (x, y, z) in json.loads(sys.argv[1]).items():
    scale = opensim.Scale()
    scale.setSegmentName(name)
    scale.setScaleFactors(opensim.Vec3(x, y, z))
    scale.setApply(True)
    factors.cloneAndAppend(scale)
model.scale(state, factors, sys.argv[3] == "True", float(sys.argv[2]))
model.printToXML("theirs.osim")
"""
QUIET = "opensim.Logger.setLevelString('Off')"
# Script that runs OpenSim's inverse kinematics.
FIT = """
import sys, opensim
opensim.Logger.setLevelString("Off")
tool = opensim.InverseKinematicsTool()
tool.set_model_file("model.osim")
tool.set_marker_file("trial.trc")
tool.set_accuracy(float(sys.argv[1]))
tool.setStartTime(0.0)
tool.setEndTime(10.0)
tool.setOutputMotionFileName("theirs.mot")
tool.run()
"""


@pytest.mark.parametrize(
    "name", ["m0005", "m0013", "m0036", "m0065", "m0109", "m0139", "m0163", "m0172", "m0954"]
)
@pytest.mark.parametrize("ground", [False, True])
def test_real_models_are_scaled_alike(corpus: Any, name: str, ground: bool, tmp_path: Path) -> None:
    """Scale all bodies by random factors, with and without a given mass of the subject."""
    converted = next(model.converted for model in corpus if model.id == name)
    (tmp_path / "model.osim").write_bytes(gzip.decompress(converted.read_bytes()))
    model = osimlite.read(tmp_path / "model.osim")
    rng = np.random.default_rng(int(name[1:]) + ground)
    factors = {
        body.name: rng.uniform(0.8, 1.3, 3).round(6).tolist()
        for body in model.components(osimlite.Body)
    }
    if ground:
        factors["ground"] = [1.0, 1.0, 1.0]
    mass, preserves = float(rng.choice([70.0, -1.0])), bool(rng.random() < 0.5)
    ask(SCALE, tmp_path, json.dumps(factors), str(mass), str(preserves))
    scale_model(model, factors, mass, preserve_mass_distribution=preserves)
    osimlite.write(model, tmp_path / "ours.osim", numbers="opensim")
    assert_same(osimlite.read(tmp_path / "ours.osim"), osimlite.read(tmp_path / "theirs.osim"))


@pytest.mark.parametrize("kind", ["loose", "clamped", "locked", "coupled"])
def test_minima_are_those_of_opensim(kind: str, tmp_path: Path) -> None:
    """Noisy markers, some of them missing; OpenSim runs at accuracy 1e-9, the finest that it reaches."""
    model, rng = model_with(kind), np.random.default_rng(4)
    osimlite.write(model, tmp_path / "model.osim")
    mechanism = osimlite.mechanism(model)
    names = [marker.name for marker in model.components(osimlite.Marker)]
    stations = [mechanism.stations[marker.path] for marker in model.components(osimlite.Marker)]
    count = len(mechanism.coordinates)
    rows = []
    for frame in range(12):
        q = mechanism.assemble(0.3 * np.sin(0.3 * frame + 1.3 * np.arange(count)))
        state = mechanism.at(q)
        row = np.concatenate([state.point(*station) for station in stations]) + rng.normal(
            0.0, 0.01, 3 * len(names)
        )
        if frame % 3 == 1:
            row[3 * (frame % 12) :][:3] = np.nan
        rows.append(row.tolist())
    write_trc(tmp_path / "trial.trc", [0.1 * frame for frame in range(12)], names, rows)
    ask(FIT, tmp_path, "1e-9")
    theirs = read_sto(tmp_path / "theirs.mot")
    ours = osimlite.inverse_kinematics(model, tmp_path / "trial.trc")
    assert theirs.columns == ours.coordinates
    assert not ours.unsettled
    turning = [info.motion_type == "rotational" for info in mechanism.coordinates]
    values = np.where(turning, np.deg2rad(theirs.rows), theirs.rows)
    for q, measured, cost in zip(values, ours.measured, ours.costs, strict=True):
        state = mechanism.at(q)
        places = np.array([state.point(*station) for station in stations])
        assert cost <= 0.5 * np.nanmean(np.sum((places - measured) ** 2, axis=1)) + 1e-12
    if kind != "clamped":
        # IPOPT keeps clamped coordinates off the ends of their ranges, which shifts the others too.
        assert ours.in_degrees == pytest.approx(theirs.rows, abs=1e-5)


@pytest.mark.parametrize(
    ("case", "setup", "model"),
    [
        ("ik_gait10", "walk_Setup_IK.xml", "gait10_subject01"),
        ("ik_id_gait2354", "subject01_Setup_IK.xml", "gait2354_subject01_simbody"),
    ],
)
def test_public_setups_at_the_best_accuracy(
    shared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str, setup: str, model: str
) -> None:
    """OpenSim at its best accuracy finds the same minimum; osimlite's cost is the lowest in every frame."""
    monkeypatch.chdir(tmp_path)
    source = shared / "oracle" / "tools" / "reference"
    tool: Any = osimlite.read_document(source / case / setup)
    trial = Path(tool.marker_file.strip()).name
    unpacked(source / case / trial, tmp_path, trial)
    unpacked(source / "models" / f"{model}.osim", tmp_path, "model.osim")
    tool.model_file, tool.marker_file, tool.output_motion_file = "model.osim", trial, "theirs.mot"
    tool.results_directory, tool.accuracy = ".", 1e-9
    osimlite.write(tool, tmp_path / "setup.xml")
    ask(f"import opensim; {QUIET}; opensim.InverseKinematicsTool('setup.xml').run()", tmp_path)
    theirs, data = (
        read_sto(tmp_path / "theirs.mot"),
        MarkerData.from_source(trial).select_times(*tool.time_range),
    )
    subject = osimlite.read("model.osim")
    ours = run_inverse_kinematics(tool, subject, data)
    mechanism = ours.mechanism
    assert theirs.columns == ours.coordinates and not ours.unsettled
    # In single frames OpenSim's line search gives up before the minimum. Which frames these are
    # depends on the processor.
    apart = np.abs(ours.in_degrees - theirs.rows).max(axis=1)
    assert np.count_nonzero(apart > 2e-5) <= 0.05 * len(apart) and apart.max() < 1e-3
    tasks = collect_targets(subject, mechanism, tool.ik_task_set.objects, data, None)
    stations = find_marker_stations(subject, mechanism)
    markers = [MarkerTarget(stations[name], weight) for name, weight in tasks.weights.items()]
    turning = [info.motion_type == "rotational" for info in mechanism.coordinates]
    poses = np.where(turning, np.deg2rad(theirs.rows), theirs.rows)
    for q, measured, wanted, cost in zip(
        poses, ours.measured, tasks.target_values, ours.costs, strict=True
    ):
        goals = [
            0.5 * goal.weight * (q[goal.coordinate] - value) ** 2
            for goal, value in zip(tasks.goals, wanted, strict=True)
        ]
        assert cost <= cost_of(mechanism, markers, measured, q) + sum(goals) + 1e-15


def test_the_setup_of_a_fit_makes_the_same_model_in_opensim(tmp_path: Path) -> None:
    """Sizes, masses and marker positions agree, starting from the generic model."""
    osimlite.write(marked(), tmp_path / "generic.osim")
    result = osimlite.fit(marked(), {"moving": person(4)[0]}, held=HELD, mass=70.0)
    texts = create_person_files(result, tmp_path / "generic.osim", tmp_path, 70.0)
    for name in (SETUP, UNSCALED):
        (tmp_path / name).write_text(texts[name])
    ask(f"import opensim; {QUIET}; opensim.ScaleTool('{SETUP}').run()", tmp_path)
    theirs = osimlite.read(tmp_path / "generic_fitted.osim")
    mechanisms = [osimlite.mechanism(model) for model in (result.model, theirs)]
    q = np.linspace(-0.3, 0.4, len(mechanisms[0].coordinates))
    ours, others = (mechanism.station_positions(q) for mechanism in mechanisms)
    assert {*ours} == {*others}
    for path, place in others.items():
        assert ours[path] == pytest.approx(place, abs=1e-9), path
    one, other = (mechanism.mass_matrix(q) for mechanism in mechanisms)
    assert one == pytest.approx(other, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("step", [8.0, 40.0])
def test_who_turns_around_is_held_at_the_end_of_the_range_in_opensim(
    step: float, tmp_path: Path
) -> None:
    """OpenSim stops at the end of the range, osimlite continues at its other end.

    The cost of osimlite's solution is never larger.
    """
    angles = np.arange(100.0, 480.0, step)
    model = turner(-180.0, 180.0)
    mechanism, stations, places = trial_of(model, poses(angles), 0.003)
    osimlite.write(model, tmp_path / "model.osim")
    names = [marker.name for marker in model.components(osimlite.Marker)]
    times = [0.02 * frame for frame in range(len(angles))]
    write_trc(tmp_path / "trial.trc", times, names, places.reshape(len(angles), -1).tolist())
    ask(FIT, tmp_path, "1e-9")
    theirs = read_sto(tmp_path / "theirs.mot")
    ours = osimlite.inverse_kinematics(model, tmp_path / "trial.trc")
    markers = [MarkerTarget(station) for station in stations]
    turned = [info.motion_type == "rotational" for info in mechanism.coordinates]
    values = np.where(turned, np.radians(theirs.rows), theirs.rows)
    costs = np.array(
        [cost_of(mechanism, markers, place, q) for place, q in zip(places, values, strict=True)]
    )
    assert (ours.costs <= costs * (1.0 + 1e-9)).all()
    held = (angles > 185.0) & (angles < 300.0)
    assert theirs["pelvis_rotation"][held] == pytest.approx(np.full(held.sum(), 180.0), abs=0.1)
    assert (ours.costs[held] < 0.5 * costs[held]).all()
