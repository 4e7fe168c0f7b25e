"""Tests of inverse kinematics from files and arrays: converged reference motions and damaged data."""

from __future__ import annotations

import gzip
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.errors import DocumentError, MissingDependency, OsimliteError, SettingError
from osimlite.fitting.marker_data import MarkerData, read_trc
from osimlite.io.tables.writers import write_trc
from tests.fitting.support import MARKERS, free_body, positions

TRIALS = Path(__file__).parents[2] / "fixtures" / "trials"


def motion(count: int = 20) -> Any:
    """Return poses (t, 6) of a smooth motion."""
    t = np.linspace(0.0, 1.0, count)[:, None]
    return 0.4 * np.sin(3.0 * t + np.arange(6.0))


def as_arrays(places: Any) -> dict[str, Any]:
    """Return the positions by marker name."""
    return {name: places[:, number] for number, name in enumerate(MARKERS)}


def unpacked(folder: Path, name: str, to: Path) -> Path:
    """Decompress a file, and return its path.

    Args:
        folder: folder of the compressed file.
        name: name without `.gz`.
        to: folder of the result.
    """
    path = to / name
    path.write_bytes(gzip.decompress((folder / f"{name}.gz").read_bytes()))
    return path


@pytest.mark.parametrize(
    ("case", "model", "trial", "setup"),
    [
        ("ik_gait10", "gait10_subject01", "subject01_walk.trc", "walk_Setup_IK.xml"),
        (
            "ik_id_gait2354",
            "gait2354_subject01_simbody",
            "subject01_walk1.trc",
            "subject01_Setup_IK.xml",
        ),
    ],
)
def test_walks_are_the_converged_ones(
    case: str, model: str, trial: str, setup: str, shared: Path, tmp_path: Path
) -> None:
    """Compare two gait models with marker weights and coordinate goals to minima of another solver.

    The reference is converged to 1e-10 rad.
    """
    reference = shared / "oracle" / "tools" / "reference"
    human = osimlite.read(unpacked(reference / "models", f"{model}.osim", tmp_path))
    tasks: Any = osimlite.read_document(reference / case / setup).ik_task_set.objects
    weights = {
        task.name: task.weight
        for task in tasks
        if type(task).__name__ == "IKMarkerTask" and task.apply
    }
    goals = {
        task.name: task.weight
        for task in tasks
        if type(task).__name__ == "IKCoordinateTask" and task.apply
    }
    data = read_trc(unpacked(reference / case, trial, tmp_path))
    known = {
        name: weight
        for name, weight in weights.items()
        if any(m.name == name for m in human.components())
    }
    rest = {
        name: 0.0
        for name in data.names
        if name not in known and any(m.name == name for m in human.components())
    }
    converged = np.load(reference / case / "converged.npz")
    times = converged["t"]
    result = osimlite.inverse_kinematics(
        human, data, weights=known | rest, coordinates=goals, start=times[0], end=times[-1]
    )
    assert list(result.coordinates) == converged["names"].tolist()
    assert result.values == pytest.approx(converged["q_si"], abs=2e-9)
    assert not result.unsettled and result.steps.mean() < 5.0


def test_files_and_arrays_are_the_same(tmp_path: Path) -> None:
    """Files in metres and millimetres and arrays give the same poses, and small marker errors."""
    values = motion()
    places = positions(values)
    times = np.linspace(0.0, 1.0, len(values)).tolist()
    model = free_body()
    results = [osimlite.inverse_kinematics(model, as_arrays(places), times=times)]
    for unit, factor in (("m", 1.0), ("mm", 1000.0)):
        path = tmp_path / f"{unit}.trc"
        write_trc(
            path, times, MARKERS, (factor * places).reshape(len(values), -1).tolist(), units=unit
        )
        results.append(osimlite.inverse_kinematics(model, path))
    for result in results:
        assert result.values == pytest.approx(values, abs=1e-8)
        assert result.marker_errors == pytest.approx(np.zeros((len(values), 4)), abs=1e-9)
    frame = results[0].to_frame()
    assert list(frame.columns) == list(results[0].coordinates) and len(frame) == len(values)
    assert results[0].to_xarray()["marker_error"].shape == (len(values), 4)


def test_the_frame_solver_finds_the_same_poses() -> None:
    """The solver takes one frame at a time, with gaps, and starts anew after `reset`."""
    places = positions(motion())
    places[7, :2] = np.nan
    model = free_body()
    whole = osimlite.inverse_kinematics(model, as_arrays(places))
    solver = osimlite.FrameSolver(model, markers=list(MARKERS))
    assert np.array([solver.step(frame) for frame in places]) == pytest.approx(
        whole.values, abs=1e-12
    )
    assert solver.places == pytest.approx(whole.places[-1], abs=1e-12)
    solver.reset()
    assert solver.step(places[0]) == pytest.approx(whole.values[0], abs=1e-9)
    with pytest.raises(
        SettingError, match="expected 4 rows of 3 numbers, one for each marker; found 3 × 3"
    ):
        solver.step(places[0, :3])
    with pytest.raises(SettingError, match="no marker 'tree'; did you mean 'three'"):
        osimlite.FrameSolver(model, markers=["tree"])


def test_a_gap_is_bridged_by_what_is_seen() -> None:
    """Three visible markers of four determine the pose; a frame with swapped markers has the largest error."""
    values = motion()
    places = positions(values)
    places[5:9, 2] = np.nan
    result = osimlite.inverse_kinematics(free_body(), as_arrays(places))
    assert result.values == pytest.approx(values, abs=1e-8)
    assert np.isnan(result.marker_errors[5:9, 2]).all()
    assert result.summary["partly_unseen"] == {"three": 0.2}
    swapped = positions(values)
    swapped[10, [0, 1]] = swapped[10, [1, 0]]
    result = osimlite.inverse_kinematics(free_body(), as_arrays(swapped))
    assert result.summary["worst_time"] == 10.0
    assert np.delete(result.values, 10, 0) == pytest.approx(np.delete(values, 10, 0), abs=1e-7)


def test_weights_count() -> None:
    """A marker of weight 0 has an error, but no influence."""
    places = positions(motion(3))
    places[:, 3] += 1.0
    result = osimlite.inverse_kinematics(free_body(), as_arrays(places), weights={"four": 0.0})
    assert result.values == pytest.approx(motion(3), abs=1e-8)
    assert result.marker_errors[:, 3] == pytest.approx(np.full(3, np.sqrt(3.0)), abs=1e-8)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda t: t.replace("PathFileType", "Path"), "this is not a marker file"),
        (
            lambda t: t.replace("\tm\t", "\tfeet\t"),
            r":3: the markers are in 'feet'; Units is one of m, mm",
        ),
        (lambda t: t.replace("one\t", "two\t"), "two markers have the name two"),
        (lambda t: "".join(t.splitlines(keepends=True)[:6]), "markers but no frames"),
        (lambda t: t.replace("\n2\t0.5", "\n2\t-0.5"), "the time -0.5 does not come after"),
        (
            lambda t: t.replace("\n2\t0.5\t", "\n2\t0.5\tgap"),
            r":8: 'gap.*' in column 3 is not a number",
        ),
        (
            lambda t: t.replace("\n2\t0.5\t", "\n2\t0,5\t"),
            r":8: '0,5' in column 2 is not a number; write decimal points instead of commas",
        ),
        (
            lambda t: t.replace("\n2\t0.5\t", "\n2\tsoon\t"),
            r":8: 'soon' in column 2 is not a number; each row starts with .* its time",
        ),
        (
            lambda t: t.replace("\n2\t0.5\t", "\n2\t0.5\t1\t1\t"),
            r":8: the row has more than the 14 cells",
        ),
    ],
)
def test_damaged_files_are_told(change: Any, sentence: str, tmp_path: Path) -> None:
    """The error is one sentence with the file and the line."""
    path = tmp_path / "trial.trc"
    write_trc(path, [0.0, 0.5, 1.0], MARKERS, positions(motion(3)).reshape(3, -1).tolist())
    path.write_text(change(path.read_text()))
    with pytest.raises(DocumentError, match=sentence):
        osimlite.inverse_kinematics(free_body(), path)


def test_what_cannot_be_fitted_is_told() -> None:
    """Names and times that do not exist are reported."""
    places = as_arrays(positions(motion(3)))
    model = free_body()
    with pytest.raises(OsimliteError, match=r"no marker of the data \(hip\) is one of the model"):
        osimlite.inverse_kinematics(model, {"hip": places["one"]})
    with pytest.raises(SettingError, match="no marker 'fore'; did you mean 'four'"):
        osimlite.inverse_kinematics(model, places, weights={"fore": 1.0})
    with pytest.raises(SettingError, match="is invalid"):
        osimlite.inverse_kinematics(model, places, weights={"one": -1.0})
    with pytest.raises(SettingError, match="no frame lies between 7 and 9 s"):
        osimlite.inverse_kinematics(model, places, start=7.0, end=9.0)
    with pytest.raises(SettingError, match="found a ndarray"):
        osimlite.inverse_kinematics(free_body(), np.zeros((4, 3)))  # type: ignore[arg-type]
    with pytest.raises(SettingError, match="the same number of frames"):
        osimlite.inverse_kinematics(model, {"one": places["one"], "two": places["two"][:1]})
    with pytest.raises(OsimliteError, match="no coordinate"):
        osimlite.inverse_kinematics(model, places, coordinates={"knee": 1.0})


def test_one_marker_at_ten_hertz_is_followed() -> None:
    """A single marker does not determine the pose; changes between frames stay small."""
    places = positions(motion(10))
    result = osimlite.inverse_kinematics(free_body(), {"one": places[:, 0]})
    assert result.marker_errors.max() < 1e-7
    assert np.abs(np.diff(result.values, axis=0)).max() < 1.0


def test_markers_of_a_table(tmp_path: Path) -> None:
    """OpenSim's own table of model markers is accepted as data."""
    from osimlite.io.tables.storage import write_sto

    places = positions(motion(4))
    path = tmp_path / "markers.sto"
    columns = [f"{name}{end}" for name in MARKERS for end in ("_tx", "_ty", "_tz")]
    write_sto(path, "markers", [0.0, 0.1, 0.2, 0.3], columns, places.reshape(4, -1).tolist())
    assert MarkerData.from_source(path).names == MARKERS
    assert osimlite.inverse_kinematics(free_body(), path).values == pytest.approx(
        motion(4), abs=1e-8
    )


def test_c3d_files_need_a_package_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The error names the package."""
    monkeypatch.setitem(sys.modules, "ezc3d", None)
    (tmp_path / "walk.c3d").write_bytes(b"")
    with pytest.raises(MissingDependency, match="pip install ezc3d"):
        osimlite.inverse_kinematics(free_body(), tmp_path / "walk.c3d")


def test_c3d_files_are_read() -> None:
    """Unit and rate of the file are used; a marker that was not seen is NaN."""
    pytest.importorskip("ezc3d")
    data = MarkerData.from_source(TRIALS / "two_markers.c3d")
    frames = np.arange(5.0)
    one = np.stack((0.1 * frames, 0.2 - 0.01 * frames, -0.3 + 0.001 * frames), axis=1)
    two = np.stack((-0.1 * frames, 0.5 + 0.01 * frames, 0.002 * frames), axis=1)
    two[3] = np.nan
    assert data.names == ("one", "two") and np.diff(data.times) == pytest.approx(0.01)
    assert data.positions == pytest.approx(np.stack((one, two), axis=1), abs=1e-6, nan_ok=True)
