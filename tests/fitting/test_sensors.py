"""Tests of orientation sensors: reading data, placing sensors on a model, and messages about missing data."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.errors import DocumentError, OsimliteError, SettingError
from osimlite.fitting.orientation_data import OrientationData
from osimlite.fitting.sensors import place_sensors
from osimlite.io.tables.storage import read_sto, write_sto
from osimlite.io.tables.writers import write_trc
from osimlite.mechanics.multibody.spatial import (
    quaternion_of,
    rotation_about_space,
    rotation_of,
    rotation_xyz,
)
from tests.cli.command import run

PLACER = """<OpenSimDocument Version="40600">
    <IMUPlacer>
        <model_file>leg.osim</model_file>
        <base_imu_label>{base}</base_imu_label>
        <base_heading_axis>x</base_heading_axis>
        <orientation_file_for_calibration>standing.sto</orientation_file_for_calibration>
        <output_model_file>worn.osim</output_model_file>
    </IMUPlacer>
</OpenSimDocument>
"""


def leg() -> osimlite.Model:
    """Return a model of a thigh and a shank."""
    model = osimlite.Model(name="leg")
    carrier: Any = model.ground
    for name, joint in (("thigh", osimlite.FreeJoint), ("shank", osimlite.PinJoint)):
        body = osimlite.Body(
            name=name,
            mass=1.0,
            mass_center=(0.0, -0.2, 0.0),
            inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0),
        )
        model.add(body)
        at = model.add(osimlite.PhysicalOffsetFrame(name=f"{name}_at", socket_parent=carrier))
        model.add(joint(name=f"{name}_joint", socket_parent_frame=at, socket_child_frame=body))
        carrier = body
    return model


def turned(*angles: float) -> Any:
    """Return the rotation matrix of body-fixed X-Y-Z angles (rad)."""
    return rotation_xyz(np.array(angles))


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    """Write a model, the setup of an IMU placer, and the orientations of a standing subject."""
    osimlite.write(leg(), tmp_path / "leg.osim")
    rows = [[*quaternion_of(turned(0.1, 0.5, 0.2)), *quaternion_of(turned(0.0, 0.5, 0.0))]]
    write_sto(tmp_path / "standing.sto", "s", [0.0], ["thigh_imu", "shank_imu"], np.array(rows).reshape(1, -1),
              kind="Quaternion")  # fmt: skip
    (tmp_path / "placer.xml").write_text(PLACER.format(base="thigh_imu"))
    return tmp_path


def test_quaternions_and_matrices_are_the_same_rotations() -> None:
    given = np.random.default_rng(1).normal(size=(30, 4))
    matrices = rotation_of(given)
    assert np.linalg.det(matrices) == pytest.approx(np.ones(30))
    unit = given / np.linalg.norm(given, axis=1)[:, None]
    assert np.abs(np.sum(quaternion_of(matrices) * unit, axis=1)) == pytest.approx(
        np.ones(30), abs=1e-14
    )
    for length in (1e-300, 1e-5, 1e300):
        assert rotation_of(length * unit) == pytest.approx(matrices, abs=1e-12)
    assert rotation_about_space((0.3, 0.4, 0.5)) == pytest.approx(
        turned(0.0, 0.0, 0.5) @ turned(0.0, 0.4, 0.0) @ turned(0.3, 0.0, 0.0)
    )
    for values in (given, matrices):
        data = OrientationData.from_source({"thigh_imu": values}, times=np.arange(30) / 10)
        assert data.values[:, 0] == pytest.approx(matrices)
        assert data.select_times(0.95, 2.0).times == pytest.approx(np.arange(10, 21) / 10)
    assert np.isnan(OrientationData.from_source({"one": np.zeros(4)}).values).all()


def test_sensors_are_worn_in_the_centres_of_mass(lab: Path) -> None:
    done = run("run", "placer.xml", "-o", "out", folder=lab)
    assert (
        (done.code, done.err) == (0, "")
        and "thigh_imu and shank_imu" in done.out
        and "heading" in done.out
    )
    model: Any = osimlite.read(lab / "out" / "worn.osim")
    for name in ("thigh", "shank"):
        frame, sensor = model[f"/bodyset/{name}/{name}_imu"], model[f"/componentset/{name}_imu"]
        assert frame.translation == (0.0, -0.2, 0.0) and sensor.socket_frame == frame.path
    one, other = (
        turned(*model[f"/bodyset/{name}/{name}_imu"].orientation) for name in ("thigh", "shank")
    )
    assert one.T @ other == pytest.approx(turned(0.1, 0.5, 0.2).T @ turned(0.0, 0.5, 0.0))


def test_a_sensor_that_is_there_is_turned() -> None:
    model: Any = leg()
    place_sensors(
        model, OrientationData.from_source({"shank_imu": turned(0.1, 0.2, 0.3), "shank": np.eye(3)})
    )
    frame = model["/bodyset/shank/shank_imu"]
    frame.translation = (1.0, 2.0, 3.0)
    placed = place_sensors(
        model, OrientationData.from_source({"shank_imu": turned(0.3, 0.2, 0.1), "shank": np.eye(3)})
    )
    assert placed == (("shank_imu",), ("shank",), None)
    assert frame.orientation == pytest.approx((0.3, 0.2, 0.1)) and frame.translation == (
        1.0,
        2.0,
        3.0,
    )
    assert len(list(model.components(osimlite.IMU))) == 1


def test_a_misspelt_sensor_is_told_with_its_line_and_nothing_is_written(lab: Path) -> None:
    (lab / "placer.xml").write_text(PLACER.format(base="tigh_imu"))
    done = run("run", "placer.xml", folder=lab)
    assert done.code == 2 and "placer.xml:4:" in done.err and "'thigh_imu'" in done.err
    assert not (lab / "worn.osim").exists()


def test_what_is_wrong_with_sensors_is_told(lab: Path) -> None:
    eye = np.eye(3)
    for data, words, said in (
        ({"thigh_imu": eye}, ("shank_imu", "x"), "unknown sensor 'shank_imu' in the data"),
        ({"thigh_imu": eye}, ("thigh_imu", "w"), "unknown axis 'w'"),
        (
            {"foot_imu": eye, "thigh": eye},
            (),
            r"no sensor of the data \(foot_imu and thigh\) has the name of a frame",
        ),
        (
            {"thigh_imu": np.full((3, 3), np.nan)},
            (),
            "the first frame of the data has no orientation of the sensor 'thigh_imu'",
        ),
    ):
        with pytest.raises(SettingError, match=said):
            place_sensors(leg(), OrientationData.from_source(data), *words)
    with pytest.raises(SettingError, match="quaternions of 4 numbers or matrices"):
        OrientationData.from_source({"thigh_imu": np.zeros((5, 3))})
    with pytest.raises(SettingError, match="the same number of frames"):
        OrientationData.from_source({"one": np.zeros((5, 4)), "two": np.zeros((4, 4))})
    with pytest.raises(OsimliteError, match="no frame of"):
        OrientationData.from_source(lab / "standing.sto").select_times(1.0, 2.0)
    write_sto(lab / "motion.sto", "m", [0.0], ["a"], [[1.0]])
    with pytest.raises(DocumentError, match="must have DataType=Quaternion"):
        OrientationData.from_source(lab / "motion.sto")
    twins: Any = leg()
    twins["/bodyset/thigh"].components.append(
        osimlite.PhysicalOffsetFrame(name="shank", socket_parent="..")
    )
    with pytest.raises(SettingError, match="several frames 'shank'"):
        place_sensors(twins, OrientationData.from_source({"shank_imu": eye}))


def worn() -> osimlite.Model:
    """Return the leg with sensors and markers."""
    model = leg()
    place_sensors(
        model,
        OrientationData.from_source(
            {"thigh_imu": turned(0.1, 0.5, 0.2), "shank_imu": turned(0.0, 0.5, 0.0)}
        ),
    )
    for body in list(model.components(osimlite.Body)):
        for number, place in enumerate(((0.1, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.3))):
            model.add(
                osimlite.Marker(
                    name=f"{body.name}{number}", socket_parent_frame=body, location=place
                )
            )
    return model


def measured(model: osimlite.Model, count: int = 8) -> tuple[Any, dict[str, Any], dict[str, Any]]:
    """Compute measurements of a smooth motion.

    Args:
        model: the leg with sensors and markers.
        count: number of frames.

    Returns:
        Poses (t, 7), quaternions by sensor, and positions by marker.
    """
    mechanism, t = osimlite.mechanism(model), np.linspace(0.0, 1.0, count)[:, None]
    poses = 0.4 * np.sin(3.0 * t + np.arange(7.0))
    sensors = {
        f"{name}_imu": np.array(
            [
                quaternion_of(mechanism.frame_transform(f"/bodyset/{name}/{name}_imu", q)[:3, :3])
                for q in poses
            ]
        )
        for name in ("thigh", "shank")
    }
    markers: Any = list(model.components(osimlite.Marker))
    places = {
        item.name: np.array([mechanism.at(q).point(*mechanism.stations[item.path]) for q in poses])
        for item in markers
    }
    return poses, sensors, places


def test_orientations_are_fitted_and_translations_stay(lab: Path) -> None:
    model: Any = worn()
    height = next(item for item in model.components(osimlite.Coordinate) if item.name.endswith("4"))
    height.default_value = 0.9
    poses, sensors, _ = measured(model)
    sensors["shank_imu"][3] = np.nan
    result = osimlite.inverse_kinematics(model, orientations=sensors, times=np.arange(8) / 10)
    assert result.sensors == ("thigh_imu", "shank_imu") and result.markers == ()
    assert result.values[:, 3:6] == pytest.approx(np.tile((0.0, 0.9, 0.0), (8, 1)))
    assert result.values[:, :3] == pytest.approx(poses[:, :3], abs=1e-8)
    assert np.delete(result.values[:, 6], 3) == pytest.approx(np.delete(poses[:, 6], 3), abs=1e-8)
    assert np.isnan(result.orientation_errors[3, 1]) and result.summary["partly_unseen"] == {
        "shank_imu": 0.125
    }
    assert (
        result.summary["rms_orientation_error"] < 1e-8
        and result.summary["worst_sensor"] in result.sensors
    )
    assert result.to_xarray()["orientation_error"].dims == ("time", "sensor")
    assert list(result.to_frame().columns) == list(result.coordinates)
    path = lab / "trial.sto"
    rows = np.stack([*sensors.values()], axis=1).reshape(8, -1).tolist()
    write_sto(
        path,
        "trial",
        (np.arange(8) / 10).tolist(),
        list(sensors),
        rows,
        kind="Quaternion",
        has_missing=True,
    )
    again = osimlite.inverse_kinematics(model, orientations=path, start=0.2, end=0.4)
    assert again.times == pytest.approx([0.2, 0.3, 0.4])
    assert again.values == pytest.approx(result.values[2:5], abs=1e-7)


def test_markers_and_orientations_are_fitted_together() -> None:
    """A sensor of weight 0 has an error, but no influence; markers determine the position of the model."""
    model = worn()
    poses, sensors, places = measured(model)
    sensors["thigh_imu"] = quaternion_of(turned(0.5, 0.0, 0.0) @ rotation_of(sensors["thigh_imu"]))
    result = osimlite.inverse_kinematics(
        model, places, orientations=sensors, weights={"thigh_imu": 0.0}
    )
    assert result.values == pytest.approx(poses, abs=1e-8)
    assert result.orientation_errors == pytest.approx(np.tile((0.5, 0.0), (8, 1)), abs=1e-8)
    assert result.turns[:, 0] == pytest.approx(np.tile((-0.5, 0.0, 0.0), (8, 1)), abs=1e-8)
    solver = osimlite.FrameSolver(model, [*places], {"thigh_imu": 0.0}, sensors=[*sensors])
    for number, q in enumerate(poses):
        seen = [values[number] for values in places.values()]
        assert solver.step(
            seen, orientations=[one[number] for one in sensors.values()]
        ) == pytest.approx(q, abs=1e-8)
    assert solver.turns == pytest.approx(result.turns[-1], abs=1e-8)
    assert solver.places == pytest.approx(result.places[-1], abs=1e-8)


def test_the_frame_solver_takes_sensors_alone() -> None:
    model = worn()
    _, sensors, _ = measured(model)
    whole = osimlite.inverse_kinematics(model, orientations=sensors)
    solver = osimlite.FrameSolver(model, sensors=["shank_imu", "thigh_imu"])
    for number, q in enumerate(whole.values):
        given = np.array([sensors["shank_imu"][number], sensors["thigh_imu"][number]])
        assert solver.step(
            orientations=given if number % 2 else rotation_of(given)
        ) == pytest.approx(q, abs=1e-9)
    with pytest.raises(
        SettingError,
        match="expected 2 quaternions or matrices, one for each sensor; found 1",
    ):
        solver.step(orientations=[[1.0, 0.0, 0.0, 0.0]])
    with pytest.raises(SettingError, match="expected 0 rows of 3 numbers"):
        solver.step([[0.0, 0.0, 0.0]], orientations=np.eye(4)[:2])
    with pytest.raises(
        SettingError, match=r"no frame with the name of a sensor \(shin_imu\); did you"
    ):
        osimlite.FrameSolver(model, sensors=["shin_imu"])


def test_what_cannot_be_fitted_is_told() -> None:
    model = worn()
    _, sensors, places = measured(model)
    for said, given in (
        ("nothing to fit", {}),
        (
            r"no frame with the name of a sensor \(foot_imu\)",
            {"orientations": {"foot_imu": np.eye(3)}},
        ),
        (
            "no sensor 'tigh_imu'; did you mean 'thigh_imu'",
            {"orientations": sensors, "weights": {"tigh_imu": 1.0}},
        ),
        ("is invalid", {"orientations": sensors, "weights": {"thigh_imu": -1.0}}),
        (
            "8 frames of the markers and the 1 frame of the",
            {"markers": places, "orientations": {"thigh_imu": np.eye(3)}},
        ),
    ):
        with pytest.raises(SettingError, match=said):
            osimlite.inverse_kinematics(model, **given)


def test_frames_with_many_sensors_missing_reach_their_best_pose(
    corpus: Any, tmp_path: Path
) -> None:
    """Nearly equal poses and coordinates at the ends of their ranges once needed more than some hundred steps."""
    path = next(result.converted for result in corpus if result.id == "m0954")
    (tmp_path / "model.osim").write_bytes(gzip.decompress(path.read_bytes()))
    model = osimlite.read(tmp_path / "model.osim")
    place_sensors(
        model,
        OrientationData.from_source(
            {f"{body.name}_imu": np.eye(3) for body in model.body_set.objects}
        ),
    )
    mechanism, rng, frames = osimlite.mechanism(model), np.random.default_rng(1), 400
    names = [f"{body.name}_imu" for body in model.body_set.objects]
    placed = {path.rpartition("/")[2]: frame for path, frame in mechanism.frames.items()}
    turning = np.array([info.motion_type == "rotational" for info in mechanism.coordinates])
    rows = []
    for number in range(frames):
        q = mechanism.values({}) + 0.15 * np.sin(0.05 * number + np.arange(len(turning))) * turning
        state = mechanism.at(q)
        rows.append(
            [
                rotation_xyz(angles)
                @ (state.transform(placed[name].body) @ placed[name].transform)[:3, :3]
                for name, angles in zip(names, rng.normal(0.0, 0.09, (len(names), 3)), strict=True)
            ]
        )
    values = np.array(rows)
    values[(rng.random(frames) < 0.3)[:, None] & (rng.random(values.shape[:2]) < 0.2)] = np.nan
    result = osimlite.inverse_kinematics(
        model, orientations=dict(zip(names, np.swapaxes(values, 0, 1), strict=True))
    )
    assert not result.unsettled and result.steps.max() < 120


TRACKER = """<OpenSimDocument Version="40600">
    <IMUInverseKinematicsTool name="it">
        <model_file>worn.osim</model_file>
        <orientations_file>standing.sto</orientations_file>
        <OrientationWeightSet name="orientation_weights">
            <objects>
                <OrientationWeight name="tigh_imu"><weight>2</weight></OrientationWeight>
            </objects>
        </OrientationWeightSet>
        <results_directory>out</results_directory>
    </IMUInverseKinematicsTool>
</OpenSimDocument>
"""


def test_a_misspelt_weight_is_told_with_its_line_before_the_run(lab: Path) -> None:
    osimlite.write(worn(), lab / "worn.osim")
    (lab / "tracker.xml").write_text(TRACKER)
    done = run("run", "tracker.xml", folder=lab)
    assert done.code == 0 and "tracker.xml:7:" in done.err and "'thigh_imu'" in done.err, done.err
    assert "2 sensors: errors of 0.00 degrees" in done.out
    assert sorted(path.name for path in (lab / "out").iterdir()) == [
        "ik_standing.mot", "ik_standing_orientationErrors.sto",
    ]  # fmt: skip
    (lab / "tracker.xml").write_text(
        TRACKER.replace("tigh_imu", "thigh_imu").replace("standing.sto", "standin.sto")
    )
    done = run("run", "tracker.xml", folder=lab)
    assert done.code == 2 and "tracker.xml:4:" in done.err


def test_a_misspelt_marker_is_told_with_its_line_before_the_run(lab: Path) -> None:
    osimlite.write(worn(), lab / "worn.osim")
    _, _, places = measured(worn())
    rows = np.stack([*places.values()], axis=1).reshape(8, -1).tolist()
    write_trc(lab / "trial.trc", [0.1 * k for k in range(8)], [*places], rows)
    tool = osimlite.InverseKinematicsTool(
        name="ik",
        model_file="worn.osim",
        marker_file="trial.trc",
        output_motion_file="ik.mot",
        time_range=(0.0, 0.5),
    )
    tool.ik_task_set.objects = [
        osimlite.IKMarkerTask(name=name, weight=1.0) for name in [*places, "thihg0"]
    ]
    osimlite.write(tool, lab / "ik.xml")
    line = (lab / "ik.xml").read_text().split("thihg0")[0].count("\n") + 1
    done = run("run", "ik.xml", folder=lab)
    assert done.code == 0 and f"ik.xml:{line}:" in done.err and "thihg0" in done.err, done.err


def test_the_command_takes_orientations(lab: Path) -> None:
    osimlite.write(worn(), lab / "worn.osim")
    done = run(
        "ik", "worn.osim", "standing.sto", "--weight", "thigh_imu=2", "-o", "out", folder=lab
    )
    assert (done.code, done.err) == (0, "") and "2 sensors: errors of 0.00 degrees" in done.out
    errors = read_sto(lab / "out" / "orientation_errors.sto")
    assert errors.columns == ("thigh_imu", "shank_imu") and errors.rows == pytest.approx(
        np.zeros((1, 2)), abs=1e-8
    )
    assert read_sto(lab / "out" / "ik.mot").in_degrees


def test_a_report_has_the_errors_of_the_sensors(lab: Path) -> None:
    pytest.importorskip("matplotlib", reason="needs matplotlib (extra 'plot')")
    osimlite.write(worn(), lab / "worn.osim")
    (lab / "tracker.xml").write_text(TRACKER.replace("tigh_imu", "thigh_imu"))
    done = run("run", "tracker.xml", "--report", "report.html", folder=lab)
    assert (done.code, done.err) == (0, "")
    page = (lab / "report.html").read_text()
    assert "<h2>Sensor errors" in page and "<h2>Marker errors" not in page
