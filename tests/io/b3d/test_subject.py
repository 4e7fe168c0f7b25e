"""Check reading of AddBiomechanics subjects: all numbers of a file, and clear errors for damaged files."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numpy", reason="needs numpy (extra 'sim')")

import osimlite
from osimlite.errors import DocumentError, MissingFileError, OsimliteError, SettingError
from osimlite.io.b3d.messages import HEADER, PASS_FIELDS
from osimlite.io.b3d.reader import read_b3d
from osimlite.io.b3d.subject import find_pressure_centers
from tests.io import b3d_files as files


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return files.write_subject(tmp_path / "it.b3d")


def test_the_header_is_read(path: Path) -> None:
    subject = osimlite.read_b3d(path)
    assert (subject.mass, subject.height, subject.age) == (70.0, 1.7, None)
    assert subject.pass_types == ("kinematics", "dynamics") and subject.quality == "experimental"
    assert subject.contact_bodies == files.BODIES and subject.marker_names == files.MARKERS
    first, second = subject.trials
    assert (first.name, first.frame_count, first.type) == ("walk/0", 12, "overground")
    assert first.features == ("walking", "flat terrain") and first.plate_height == 0.01
    assert second.times[0] == 0.5 and second.times[-1] == pytest.approx(0.56)
    assert first.missing_forces.tolist() == [0] * 11 + [5]
    assert subject.read_model().name == "walker"


def test_a_changed_model_changes_no_later_reading(path: Path) -> None:
    subject = osimlite.read_b3d(path)
    model = subject.read_model()
    model.gravity = (0.0, 0.0, 0.0)
    for joint in list(model.joint_set.objects):
        joint.coordinates.clear()
    assert subject.read_model().gravity != model.gravity
    assert subject.trials[0].read_coordinates().columns == files.NIMBLE_ORDER


def test_every_number_is_read(path: Path) -> None:
    subject = read_b3d(path)
    for index, trial in enumerate(subject.trials):
        sensors, processed = files.make_arrays(trial.frame_count, index)
        for expected, result in (
            (sensors, trial.read_arrays()),
            (processed, trial.read_arrays(0)),
            (processed, trial.read_arrays(1)),
        ):
            assert result.keys() == expected.keys()
            for name, array in expected.items():
                np.testing.assert_array_equal(result[name], array, name)


def test_blocks_together_are_the_trial(path: Path) -> None:
    trial = read_b3d(path).trials[0]
    complete = trial.read_arrays(1)
    blocks = list(trial.read_blocks(1, block_bytes=5000))
    assert len(blocks) > 2
    for name, array in complete.items():
        np.testing.assert_array_equal(np.concatenate([block[name] for block in blocks]), array)


def test_coordinates_have_the_names_of_the_model_in_nimbles_order(path: Path) -> None:
    trial = read_b3d(path).trials[0]
    table = trial.read_coordinates()
    assert table.columns == files.NIMBLE_ORDER and not table.in_degrees
    np.testing.assert_array_equal(table["ty"], files.make_arrays(12)[1]["positions"][:, 4])
    assert trial.read_moments("kinematics").columns[0] == "tilt_moment"


def test_markers_without_a_name_are_left_out(path: Path) -> None:
    names, positions = read_b3d(path).trials[0].read_markers()
    assert names == ("RASI", "LASI") and positions.shape == (12, 2, 3)
    assert np.isnan(positions[6, 0]).all() and np.isfinite(positions[6, 1]).all()


def test_ground_forces_are_exactly_the_wrenches(path: Path) -> None:
    trial = read_b3d(path).trials[0]
    wrenches, table = trial.read_wrenches(), trial.read_ground_forces()
    assert table.columns[:4] == tuple(
        f"ground_force_calcn_r_{part}" for part in ("vx", "vy", "vz", "px")
    )
    for body in range(2):
        force, point, torque = np.split(table.rows[:, 9 * body : 9 * body + 9], 3, axis=1)
        np.testing.assert_array_equal(force, wrenches[:, body, 3:])
        np.testing.assert_allclose(
            torque + np.cross(point, force), wrenches[:, body, :3], atol=1e-12
        )
        loaded = force[:, 1] > 10.0
        assert (
            np.allclose(point[loaded, 1], 0.01) and np.abs(torque[loaded][:, [0, 2]]).max() < 1e-12
        )


def test_points_of_small_forces_are_those_of_the_nearest_large_one() -> None:
    force = np.zeros((6, 3))
    force[[1, 5], 1] = 100.0
    torque = np.zeros((6, 3))
    torque[1, 2], torque[5, 2] = 10.0, 50.0
    points = find_pressure_centers(torque, force, 0.0)
    assert points[:, 0].tolist() == [0.1, 0.1, 0.1, 0.1, 0.5, 0.5]
    assert not find_pressure_centers(torque, np.zeros((6, 3)), 0.3).any()


def test_forces_serve_where_a_file_has_no_wrenches(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trial = read_b3d(path).trials[0]
    expected = trial.read_wrenches()
    arrays = trial.read_arrays(1)
    del arrays["contact_wrenches"]
    monkeypatch.setattr(type(trial), "read_arrays", lambda self, index=None: arrays)
    np.testing.assert_allclose(trial.read_wrenches(), expected, atol=1e-12)


def test_passes_are_found_by_type_or_index(path: Path) -> None:
    trial = read_b3d(path).trials[0]
    assert [trial.find_pass(each) for each in (None, "kinematics", 1)] == [1, 0, 1]
    for wrong in ("lowpass-filter", 2, -1):
        with pytest.raises(SettingError, match="it has: kinematics, dynamics"):
            trial.find_pass(wrong)


def _change(**values: object) -> bytes:
    """Return a file with other values in its header."""
    header = files.make_header(osimlite.to_text(files.make_walker()), (1,), (1,)) | values
    frame = files.make_subject((1,), (1,))
    size = header["sensor_frame_size"] + header["pass_frame_size"]
    return files.encode_file(files.encode_message(header, HEADER), frame[-size:])


VERSION_1 = files.encode_bytes(10, b"walking") + b"\x68\x01"
VERSION_3 = files.encode_varint(17 << 3 | 1) + b"\0" * 8 + b"\x50\x03"
# Contents of damaged files, each with the message that it must give.
DAMAGED = {
    "empty": (b"", "this is not a .b3d file"),
    "short": (b"\x01\0\0", "this is not a .b3d file"),
    "text": (b"time\tx\n0\t1\n", "this is not a .b3d file"),
    "cut header": (files.make_subject()[:500], "cut off within its header"),
    "cut frames": (files.make_subject()[:-1], "but its header describes"),
    "longer": (files.make_subject() + b"\0", "but its header describes"),
    "no version": (files.encode_file(b"\x08\x01"), "has no version"),
    "version 1": (
        files.encode_file(VERSION_1),
        "version 1 of the format; osimlite reads version 4",
    ),
    "version 3": (files.encode_file(VERSION_3), "version 3 of the format"),
    "version 5": (_change(version=5), "version 5 of the format"),
    "version 2": (
        files.encode_file(files.encode_bytes(10, b"a") + b"\x68\x02"),
        "version 2 of the format",
    ),
    "negative size": (_change(sensor_frame_size=-1), "'sensor_frame_size' is -1"),
    "no time step": (
        _change(trials=[{"frame_count": 1, "time_step": 0.0}]),
        "time step of trial 0",
    ),
    "too many passes": (_change(passes=[]), "more processing passes than the file"),
    "not text": (
        files.encode_file(files.encode_bytes(11, b"\xff") + b"\x50\x04"),
        "not text in UTF-8",
    ),
}


@pytest.mark.parametrize("case", DAMAGED)
def test_a_damaged_header_is_a_clear_error(tmp_path: Path, case: str) -> None:
    content, message = DAMAGED[case]
    (tmp_path / "it.b3d").write_bytes(content)
    with pytest.raises(DocumentError) as error:
        read_b3d(tmp_path / "it.b3d")
    assert message in str(error.value) and "it.b3d" in str(error.value)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (_change(dof_count=9), "'positions' has 10 numbers instead of 9"),
        (_change(marker_names=("a",)), "'markers' has 9 numbers instead of 3"),
        (files.make_subject((1,), (1,))[:-40] + b"\0" * 40, "is damaged"),
        (files.make_subject((1,), (1,), "<x/>"), "the model of processing pass 0 cannot be read"),
        (files.make_subject((1,), (1,), osimlite.to_text(osimlite.Model(name="m"))), "has 0"),
    ],
)
def test_damaged_frames_and_models_are_clear_errors(
    tmp_path: Path, content: bytes, message: str
) -> None:
    (tmp_path / "it.b3d").write_bytes(content)
    trial = read_b3d(tmp_path / "it.b3d").trials[0]
    with pytest.raises(OsimliteError, match=message):
        trial.read_arrays(0)
        trial.read_markers()
        trial.read_coordinates()


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match="no such file"):
        read_b3d(tmp_path / "gone.b3d")


def test_a_frame_with_its_fields_in_another_order_is_read(tmp_path: Path) -> None:
    content = files.make_subject((2,), (1,))
    _, processed = files.make_arrays(2)
    last = files.encode_frame({n: v[1] for n, v in processed.items()}, PASS_FIELDS)
    assert content.endswith(last)
    length = 2 + 8 * len(files.NIMBLE_ORDER)
    moved = content[: -len(last)] + last[length:] + last[:length]
    (tmp_path / "it.b3d").write_bytes(moved)
    result = read_b3d(tmp_path / "it.b3d").trials[0].read_arrays(0)
    for name, array in processed.items():
        np.testing.assert_array_equal(result[name], array)


def test_importing_osimlite_does_not_load_the_reader() -> None:
    code = "import sys, osimlite; print(*[name for name in sys.modules if 'b3d' in name or 'numpy' in name])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


@pytest.mark.parametrize("seed", range(8))
def test_changed_bytes_give_clear_errors_only(tmp_path: Path, seed: int) -> None:
    """Change bytes but not the size of the file, so that the frames are read too."""
    rng = np.random.default_rng(seed)
    content = files.make_subject((4, 3))
    refused = 0
    for _ in range(25):
        changed = bytearray(content)
        # Changes in the text of the models, which is most of the header, do no harm.
        start = rng.choice([8, len(content) - 10_000])
        for position in rng.integers(start, min(start + 10_000, len(content)), 3):
            changed[position] = rng.integers(256)
        (tmp_path / "it.b3d").write_bytes(changed)
        try:
            subject = read_b3d(tmp_path / "it.b3d")
            for trial in subject.trials:
                trial.read_arrays()
                trial.read_ground_forces()
                trial.read_coordinates()
                trial.read_markers()
                trial.read_force_plates()
        except OsimliteError as error:
            refused += 1
            assert error.message
    assert refused
