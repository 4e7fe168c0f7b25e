"""Compare IMUPlacer and inverse kinematics of orientations with a live OpenSim."""

from __future__ import annotations

import gzip
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import write_sto
from osimlite.io.tables.writers import write_trc
from osimlite.mechanics.multibody.spatial import quaternion_of, rotation_of, rotation_xyz
from tests.fitting.support import assert_same
from tests.oracle.support import ask, model_with

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

PLACER = """<OpenSimDocument Version="40600">
    <IMUPlacer>
        <model_file>model.osim</model_file>
        <base_imu_label>{base}</base_imu_label>
        <base_heading_axis>{axis}</base_heading_axis>
        <sensor_to_opensim_rotations>{turn}</sensor_to_opensim_rotations>
        <orientation_file_for_calibration>standing.sto</orientation_file_for_calibration>
        <output_model_file>placed.osim</output_model_file>
    </IMUPlacer>
</OpenSimDocument>
"""
# Script that runs OpenSim's IMUPlacer.
PLACE = """
import opensim
opensim.Logger.setLevelString("Off")
assert opensim.IMUPlacer("placer.xml").run()
"""

TOOL = """<OpenSimDocument Version="40600">
    <IMUInverseKinematicsTool name="imu">
        <model_file>model.osim</model_file>
        <time_range>0.1 1.05</time_range>
        <output_motion_file>{motion}</output_motion_file>
        <results_directory>{results}</results_directory>
        <report_errors>{errors}</report_errors>
        <sensor_to_opensim_rotations>-1.5 0.4 0.3</sensor_to_opensim_rotations>
        <orientations_file>trial.sto</orientations_file>
        <OrientationWeightSet name="orientation_weights">
            <objects>
                <OrientationWeight name="b1_imu"><weight>3</weight></OrientationWeight>
                <OrientationWeight name="b0_imu"><weight>0</weight></OrientationWeight>
            </objects>
        </OrientationWeightSet>
    </IMUInverseKinematicsTool>
</OpenSimDocument>
"""
# Script that runs OpenSim's IMUInverseKinematicsTool.
TRACK = """
import opensim
opensim.Logger.setLevelString("Off")
assert opensim.IMUInverseKinematicsTool("tool.xml").run()
"""
# Script that fits orientations, and markers if there are any, with OpenSim.
SOLVE = """
import json, os, sys, opensim
opensim.Logger.setLevelString("Off")
accuracy, weights, has_markers = float(sys.argv[1]), json.loads(sys.argv[2]), os.path.exists("trial.trc")
model = opensim.Model("model.osim")
coordinates = [model.getCoordinateSet().get(k) for k in range(model.getCoordinateSet().getSize())]
for item in coordinates:
    if not has_markers and item.getMotionType() == opensim.Coordinate.Translational:
        item.setDefaultLocked(True)
found = opensim.OpenSenseUtilities.convertQuaternionsToRotations(opensim.TimeSeriesTableQuaternion("trial.sto"))
weighed = opensim.OrientationWeightSet()
for name, weight in weights.items():
    weighed.cloneAndAppend(opensim.OrientationWeight(name, weight))
markers = opensim.MarkersReference(*(("trial.trc", opensim.SetMarkerWeights()) if has_markers else ()))
state = model.initSystem()
times = found.getIndependentColumn()
solver = opensim.InverseKinematicsSolver(
    model, markers, opensim.OrientationsReference(found, weighed), opensim.SimTKArrayCoordinateReference()
)
solver.setAccuracy(accuracy)
state.setTime(times[0])
solver.assemble(state)
rows = []
for time in times:
    state.setTime(time)
    solver.track(state)
    rows.append([item.getValue(state) for item in coordinates])
json.dump(rows, open("theirs.json", "w"))
"""


def real_model(corpus: Any, name: str, folder: Path) -> osimlite.Model:
    """Write OpenSim's print of a corpus model into a folder and read it from there."""
    converted = next(model.converted for model in corpus if model.id == name)
    (folder / "model.osim").write_bytes(gzip.decompress(converted.read_bytes()))
    return osimlite.read(folder / "model.osim")


def write_orientations(
    path: Path, times: Sequence[float], names: Sequence[str], rotations: Any
) -> None:
    """Write rotation matrices (t, k, 3, 3) as a table of quaternions."""
    rows = quaternion_of(rotations).reshape(len(times), -1).tolist()
    write_sto(path, "orientations", times, names, rows, kind="Quaternion", has_missing=True)


@pytest.mark.parametrize(
    ("name", "axis"),
    [
        ("m0013", "x"),
        ("m0172", "-z"),
        ("m0954", "Y"),
        ("m0097", "z"),
        ("m0109", "-x"),
        ("m0163", ""),
    ],
)
def test_sensors_are_placed_alike(corpus: Any, name: str, axis: str, tmp_path: Path) -> None:
    """Sensors on random bodies in random orientations; the model m0097 has sensors already."""
    model, rng = real_model(corpus, name, tmp_path), np.random.default_rng(int(name[1:]))
    bodies = [body.name for body in model.body_set.objects]
    worn = [str(body) for body in rng.choice(bodies, min(5, len(bodies)), replace=False)]
    names = [f"{body}_imu" for body in worn] + ["nowhere_imu", "plain"]
    write_orientations(
        tmp_path / "standing.sto",
        [0.5, 0.6],
        names,
        rotation_of(rng.normal(size=(2, len(names), 4))),
    )
    turn = " ".join(map(str, rng.uniform(-3.0, 3.0, 3)))
    (tmp_path / "placer.xml").write_text(
        PLACER.format(base=names[0] if axis else "", axis=axis, turn=turn)
    )
    ask(PLACE, tmp_path)
    outcome = osimlite.run(tmp_path / "placer.xml", tmp_path / "ours", check=False)
    assert outcome.summary["left_out"] == ("nowhere_imu", "plain")
    ours = osimlite.read(tmp_path / "ours" / "placed.osim")
    assert_same(ours, osimlite.read(tmp_path / "placed.osim"))
    assert {imu.path for imu in ours.components(osimlite.IMU)} >= {
        f"/componentset/{body}_imu" for body in worn
    } - {imu.path for imu in model.components(osimlite.IMU)}


def wear(model: osimlite.Model) -> list[str]:
    """Add a sensor frame in random orientation to each body and to ground; return the names of the sensors."""
    rng, names = np.random.default_rng(7), []
    for frame in (*model.components(osimlite.Body), model.ground):
        turn = tuple(rng.uniform(-3.0, 3.0, 3).tolist())
        names.append(f"{frame.name}_imu")
        frame.components.append(
            osimlite.PhysicalOffsetFrame(name=names[-1], socket_parent="..", orientation=turn)
        )
    return names


def trial(
    folder: Path, model: osimlite.Model, names: Sequence[str], noise: float, *, markers: bool
) -> Any:
    """Write a noisy recording of a motion by sensors, and optionally by markers.

    Args:
        folder: folder for ``trial.sto`` and ``trial.trc``.
        model: model with sensor frames.
        names: names of the sensors.
        noise: standard deviation of the angles (rad).
        markers: whether to write the markers too.

    Returns:
        Rotation matrices (t, k, 3, 3) of the sensors, NaN in three places.
    """
    mechanism, rng = osimlite.mechanism(model), np.random.default_rng(3)
    frames = {path.rpartition("/")[2]: frame for path, frame in mechanism.frames.items()}
    times, rotations, rows = [0.1 * k for k in range(12)], [], []
    for time in times:
        q = mechanism.assemble(
            0.3 * np.sin(3.0 * time + 1.3 * np.arange(len(mechanism.coordinates)))
        )
        state = mechanism.at(q)
        off = [rotation_xyz(angles) for angles in rng.normal(0.0, noise, (len(names), 3))]
        placed = [
            (state.transform(frames[name].body) @ frames[name].transform)[:3, :3] for name in names
        ]
        rotations.append(np.array(off) @ placed)
        places = [
            state.point(*mechanism.stations[marker.path])
            for marker in model.components(osimlite.Marker)
        ]
        rows.append((np.concatenate(places) + rng.normal(0.0, 0.01, 3 * len(places))).tolist())
    result = np.array(rotations)
    result[[3, 7, 8], [2, 3, 2]] = np.nan
    if markers:
        marked = [marker.name for marker in model.components(osimlite.Marker)]
        write_trc(folder / "trial.trc", times, marked, rows)
    write_orientations(folder / "trial.sto", times, names, result)
    return result


def squared(mechanism: Any, names: Sequence[str], q: Any, rotations: Any) -> Any:
    """Return the squared angles (k,) between measured and modelled orientations (rad^2).

    The angle of a sensor without a measurement is NaN.
    """
    state, result = mechanism.at(q), []
    frames = {path.rpartition("/")[2]: frame for path, frame in mechanism.frames.items()}
    for name, wanted in zip(names, rotations, strict=True):
        off = (state.transform(frames[name].body) @ frames[name].transform)[:3, :3] @ wanted.T
        real, *imaginary = quaternion_of(off)
        result.append((2.0 * np.arctan2(np.linalg.norm(imaginary), abs(real))) ** 2)
    return np.array(result)


@pytest.mark.parametrize("markers", [False, True])
@pytest.mark.parametrize("kind", ["loose", "clamped", "locked", "coupled"])
def test_minima_of_angles_are_those_of_opensim(kind: str, markers: bool, tmp_path: Path) -> None:
    """Noisy sensors with gaps and weights, with and without markers; OpenSim runs as exactly as it can."""
    model: Any = model_with(kind)
    for number, item in enumerate(model.components(osimlite.Coordinate)):
        item.default_value = item.default_value or 0.01 * number
    names = wear(model)
    osimlite.write(model, tmp_path / "model.osim")
    rotations = trial(tmp_path, model, names, 0.1, markers=markers)
    weights = {"b0_imu": 2.0, "b2_imu": 0.5}
    # With couplers IPOPT does not reach 1e-9: it finds no pose that fulfils them so exactly.
    accuracy = 1e-7 if kind == "coupled" else 1e-9
    ask(SOLVE, tmp_path, str(accuracy), json.dumps(weights))
    theirs = np.array(json.loads((tmp_path / "theirs.json").read_text()))
    source = tmp_path / "trial.trc" if markers else None
    ours = osimlite.inverse_kinematics(
        model, source, orientations=tmp_path / "trial.sto", weights=weights
    )
    assert (
        not ours.unsettled
        and len(ours.sensors) == 4
        and np.isnan(ours.orientation_errors).sum() == 3
    )
    mechanism, shares = (
        osimlite.mechanism(model),
        np.array([weights.get(name, 1.0) for name in names]),
    )
    stations = [mechanism.stations[marker.path] for marker in model.components(osimlite.Marker)]
    for number, q in enumerate(theirs):
        angles = squared(mechanism, names, q, rotations[number])
        seen = np.isfinite(angles)
        cost = 0.5 * shares[seen] @ angles[seen] / shares[seen].sum()
        if markers:
            places = np.array([mechanism.at(q).point(*station) for station in stations])
            cost += 0.5 * np.mean(np.sum((places - ours.measured[number]) ** 2, axis=1))
        assert ours.costs[number] <= cost + 1e-9 * (kind == "coupled") + 1e-13
    if kind != "clamped":
        assert np.rad2deg(ours.values) == pytest.approx(
            np.rad2deg(theirs), abs=1e-3 if kind == "coupled" else 1e-5
        )


@pytest.mark.parametrize(
    ("results", "motion", "errors"),
    [
        ("here", "", "true"),
        ("here", "away/it", "true"),
        ("", "here/it.sto", "false"),
        ("here", "a.b/", "true"),
    ],
)
def test_the_tool_writes_opensims_files(
    results: str, motion: str, errors: str, tmp_path: Path
) -> None:
    """Names, headers, columns and digits of the output files agree.

    No frame fits worse than OpenSim's. It fits better only by less than OpenSim's convergence
    tolerance explains.
    """
    model: Any = model_with("loose")
    names = wear(model)
    osimlite.write(model, tmp_path / "model.osim")
    rotations = trial(tmp_path, model, [*names[::-1]], 0.2, markers=False)
    write_orientations(
        tmp_path / "trial.sto",
        [0.1 * k for k in range(12)],
        ["lost", *names[::-1]],
        np.concatenate([rotations[:, :1], rotations], axis=1),
    )
    (tmp_path / "tool.xml").write_text(TOOL.format(results=results, motion=motion, errors=errors))
    ask(TRACK, tmp_path)
    theirs = {path.name: path.read_text() for path in (tmp_path / "here").iterdir()}
    outcome = osimlite.run(tmp_path / "tool.xml", check=False)
    assert {path.name for path in outcome.files} == set(theirs) and len(theirs) == 1 + (
        errors == "true"
    )
    for path in outcome.files:
        assert path.parent == tmp_path / "here"
        known = [
            line for line in theirs[path.name].splitlines() if not line.startswith("OpenSimVersion")
        ]
        lines = path.read_text().splitlines()
        head = known.index("endheader") + 2
        assert lines[:head] == known[:head] and len(lines) == len(known)
        values, asked = (
            np.array([line.split("\t") for line in text[head:]], dtype=float)
            for text in (lines, known)
        )
        assert values[:, 0].tolist() == asked[:, 0].tolist()
        if "Errors" in path.name:
            assert ((values == 0.0) == (asked == 0.0)).all() and (asked == 0.0).any()
            weights = [
                {"b0_imu": 0.0, "b1_imu": 3.0}.get(name, 1.0)
                for name in lines[head - 1].split("\t")[1:]
            ]
            shares = np.array(weights)[None] * (asked[:, 1:] > 0.0)
            ours, cost = (np.sum(shares * table[:, 1:] ** 2, axis=1) for table in (values, asked))
            assert (ours <= cost + 1e-12).all() and (ours >= cost - 1e-3).all()
        else:
            assert values == pytest.approx(asked, abs=3.0)
