"""Compare files of AddBiomechanics and rewritten models with a live nimblephysics.

Files must have Nimble's numbers, and rewritten models must move in OpenSim as the originals in
Nimble.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.io.b3d.reader import read_b3d
from osimlite.io.b3d.subject import B3dTrial
from osimlite.io.nimble import list_coordinates
from osimlite.mechanics.multibody.dynamics import Wrench
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.translate.nimble import convert_from_nimble
from tests.io import b3d_files as files
from tests.nimble import ask_nimble, find_nimble_poses
from tests.translate.nimble_models import CUSTOM, make_custom, make_ellipsoid

pytestmark = [pytest.mark.full, pytest.mark.oracle]

DATA = "OSIMLITE_NIMBLE_DATA"
"""Variable that names a checkout of nimblephysics, whose folder `data` has public models and a .b3d file."""

# Number of random states that are compared.
STATES = 200

MODELS = (
    "osim/CompleteHumanModel/CompleteHumanModel.osim",
    "osim/ScapulaModel/ScapulothoracicJoint_Shoulder.osim",
    "osim/Rajagopal2015/Rajagopal2015.osim",
    "osim/LaiArnoldSubject6/LaiArnold2017_refined.osim",
    "osim/ComplexKnee/gait2392_frontHingeKnee_dem.osim",
    "osim/HighBMI/Lernagopal_more_viz.osim",
    "osim/bsm/bsm.osim",
)

REASONS = {0: "notMissingGRF", 2: "unmeasuredExternalForceDetected", 5: "notOverForcePlate"}
"""Nimble's names of the reasons in the files, by their numbers in the file format.

Nimble's Python enumeration has other numbers.
"""


def find_data(name: str) -> Path:
    folder = os.environ.get(DATA)
    if not folder:
        pytest.skip(f"needs public files: {DATA} names no checkout of keenon/nimblephysics")
    path = Path(folder, "data", name)
    if not path.is_file() or not path.stat().st_size:
        pytest.skip(f"needs {path}")
    return path


def find_opensim_poses(path: Path, names: list[str], states: Any) -> list[dict[str, Any]]:
    opensim = pytest.importorskip("opensim", reason="needs OpenSim (extra 'oracle')")
    opensim.Logger.setLevelString("Error")
    model = opensim.Model(str(path))
    state = model.initSystem()
    coordinates, bodies, result = model.getCoordinateSet(), model.getBodySet(), []
    for values in states:
        for name, value in zip(names, values, strict=True):
            coordinate = coordinates.get(name)
            coordinate.setLocked(state, False)
            coordinate.setValue(state, float(value), False)
        model.realizePosition(state)
        poses = {}
        for index in range(bodies.getSize()):
            transform = bodies.get(index).getTransformInGround(state)
            turn, place = transform.R(), transform.p()
            rows = [[turn.get(i, j) for j in range(3)] + [place.get(i)] for i in range(3)]
            poses[bodies.get(index).getName()] = [*rows, [0.0, 0.0, 0.0, 1.0]]
        result.append(poses)
    return result


def make_explicit(path: Path) -> Path:
    """Write the mass centres of the test models explicitly, which Nimble's reader requires."""
    text = path.read_text().replace("<inertia>", "<mass_center>0 0 0</mass_center><inertia>")
    path.write_text(text)
    return path


def compare_poses(source: Path, folder: Path, tolerance: float) -> float:
    """Compare a rewritten model in OpenSim with the original one in Nimble.

    Args:
        source: original model.
        folder: folder for the rewritten model.
        tolerance: largest difference of poses (m, or entries of rotation matrices).

    Returns:
        The largest difference of the original model in OpenSim, before it was rewritten.
    """
    model = osimlite.read(source)
    coordinates = list_coordinates(model)
    rng = np.random.default_rng(0)
    states = [
        [rng.uniform(min(each.range), max(each.range)) for each in coordinates]
        for _ in range(STATES)
    ]
    names, expected = find_nimble_poses(source, states)
    assert names == [each.name for each in coordinates]
    before = find_opensim_poses(source, names, states[:20])
    convert_from_nimble(model)
    osimlite.write(model, folder / "rewritten.osim")
    after = find_opensim_poses(folder / "rewritten.osim", names, states)

    defects = {body: max(measure_defect(poses[body]) for poses in expected) for body in expected[0]}

    def differ(results: list[dict[str, Any]], allowed: float = 0.0) -> float:
        return max(
            float(np.abs(np.array(pose) - np.array(result[body])).max()) - allowed * defects[body]
            for result, poses in zip(results, expected, strict=False)
            for body, pose in poses.items()
        )

    assert differ(after, allowed=1.0) < tolerance
    return differ(before)


def measure_defect(pose: Any) -> float:
    """Return how far the rotation of a Nimble pose is from orthogonal: the largest entry of R^T R - I.

    Nimble uses axes with the digits of the file and does not normalise them. OpenSim's rotations
    are orthogonal, so that no joint of OpenSim can be nearer than about half of this.
    """
    turn = np.array(pose)[:3, :3]
    return float(np.abs(turn.T @ turn - np.eye(3)).max())


@pytest.mark.parametrize("name", MODELS)
def test_public_models_move_in_opensim_as_in_nimble(tmp_path: Path, name: str) -> None:
    compare_poses(find_data(name), tmp_path, 1e-9)


@pytest.mark.parametrize("case", [*CUSTOM, "ellipsoid"])
def test_single_joints_move_in_opensim_as_in_nimble(tmp_path: Path, case: str) -> None:
    if case == "ellipsoid":
        model = make_ellipsoid()
        for coordinate in model.components(osimlite.Coordinate):
            coordinate.range = (-1.5, 1.5)
    else:
        model = make_custom(*CUSTOM[case][:2])
    osimlite.write(model, tmp_path / "it.osim")
    before = compare_poses(make_explicit(tmp_path / "it.osim"), tmp_path, 1e-12)
    assert (before > 0.01) == (case == "ellipsoid" or CUSTOM[case][2] is not None)


def compare_subject(path: Path) -> None:
    answer = ask_nimble("subject", str(path.resolve()))
    subject = read_b3d(path)
    header = answer["header"]
    assert (header["mass"], header["height"]) == (subject.mass, subject.height)
    assert (
        header["bodies"] == list(subject.contact_bodies)
        and header["dofs"] == subject.header["dof_count"]
    )
    assert header["tags"] == list(subject.header["tags"]) and header["age"] == subject.header["age"]
    assert [each["name"] for each in answer["trials"]] == [each.name for each in subject.trials]
    for expected, trial in zip(answer["trials"], subject.trials, strict=True):
        assert expected["step"] == trial.time_step
        assert expected["missing"] == [REASONS[reason] for reason in trial.missing_forces]
        arrays = trial.read_arrays()
        names, positions = trial.read_markers()
        for frame, seen in enumerate(expected["markers"]):
            # Nimble lists the visible markers only; our tables have NaN for the others.
            for index, name in enumerate(names):
                if name in seen and not np.isnan(seen[name]).any():
                    assert seen[name] == positions[frame, index].tolist()
                else:
                    assert np.isnan(positions[frame, index]).any()
        for key, name in (
            ("plates", "plate_forces"),
            ("plate_points", "plate_points"),
            ("plate_torques", "plate_torques"),
        ):
            np.testing.assert_array_equal(
                np.reshape(expected[key], (trial.frame_count, -1)), arrays[name]
            )
        for index in range(len(trial.passes)):
            processed = trial.read_arrays(index)
            for frame, passes in enumerate(expected["passes"]):
                for name, values in passes[index].items():
                    np.testing.assert_array_equal(np.ravel(values), processed[name][frame], name)


def test_a_file_that_we_wrote_has_the_same_numbers_in_nimble(tmp_path: Path) -> None:
    compare_subject(files.write_subject(tmp_path / "it.b3d"))


def test_a_recorded_file_has_the_same_numbers_in_nimble() -> None:
    compare_subject(find_data("b3d/results.b3d"))


def test_nimble_has_the_names_of_the_walker(tmp_path: Path) -> None:
    osimlite.write(files.make_walker(), tmp_path / "it.osim")
    names, _ = find_nimble_poses(
        make_explicit(tmp_path / "it.osim"), [[0.0] * len(files.NIMBLE_ORDER)]
    )
    assert names == list(files.NIMBLE_ORDER)


def make_mechanism_of_nimble(trial: B3dTrial, gravity: tuple[float, float, float]) -> Mechanism:
    """Return the mechanism of a recorded trial as Nimble computes it, with massless patellae."""
    model = trial.subject.read_model(0)
    model.gravity = gravity
    for body in model.components(osimlite.Body):
        if body.name.startswith("patella"):
            body.mass, body.mass_center, body.inertia = 0.0, (0.0, 0.0, 0.0), (0.0,) * 6
    return osimlite.mechanism(model)


def compute_moments(trial: B3dTrial, mechanism: Mechanism, *, with_ground_forces: bool) -> Any:
    """Return inverse dynamics (frames, dofs) of the first pass of a trial (N m and N).

    Args:
        trial: recorded trial.
        mechanism: mechanism of its model.
        with_ground_forces: whether the recorded ground reactions are applied.
    """
    arrays, columns = trial.read_arrays(0), trial.read_coordinates().columns
    names = [body.name.rpartition("/")[2] for body in mechanism.bodies]
    indices = [mechanism.coordinate_names.index(name) for name in columns]

    def complete(values: Any) -> dict[str, float]:
        state = dict(zip(columns, map(float, values), strict=True))
        # A coupler makes the patellae follow the knees.
        return state | {f"knee_angle_{side}_beta": state[f"knee_angle_{side}"] for side in "rl"}

    result = []
    for frame, wrenches in enumerate(trial.read_wrenches(0)):
        q = complete(arrays["positions"][frame])
        state, applied = mechanism.at(q), {}
        for body, (torque, force) in zip(
            trial.subject.contact_bodies, wrenches.reshape(-1, 2, 3), strict=True
        ):
            origin = state.point(names.index(body), np.zeros(3))
            # The torque in the file is about the origin of ground.
            applied[body] = Wrench(force, torque - np.cross(origin, force))
        moments = mechanism.inverse_dynamics(
            q,
            complete(arrays["velocities"][frame]),
            complete(arrays["accelerations"][frame]),
            applied if with_ground_forces else None,
        )
        result.append(moments[indices])
    return np.array(result)


@pytest.mark.parametrize("index", [0, 1])
def test_moments_of_a_recorded_file_are_those_of_inverse_dynamics(index: int) -> None:
    """The file was computed with the gravity of Nimble's parser, along -z.

    Its first and last frames are zero.
    """
    trial = read_b3d(find_data("b3d/results.b3d")).trials[index]
    mechanism = make_mechanism_of_nimble(trial, (0.0, 0.0, -9.81))
    arrays, columns = trial.read_arrays(0), trial.read_coordinates().columns
    difference = np.abs(
        compute_moments(trial, mechanism, with_ground_forces=True) - arrays["moments"]
    )
    assert not arrays["moments"][[0, -1]].any()
    # Segments above the pelvis agree exactly. The version of Nimble that wrote the file in 2023 had
    # slightly different curves of the knees: its mass centre differs by 8 um, that of the present
    # version does not.
    above = columns.index("lumbar_extension")
    print(
        f"above the pelvis {difference[1:-1, above:].max():.1e}, all {difference[1:-1].max():.2f}"
    )
    assert difference[1:-1, above:].max() < 2e-7
    assert difference[1:-1].max() < 1.0
    assert np.median(difference[1:-1]) < 1e-3
    # With the model's own gravity, along -y, the vertical force on the pelvis differs by the
    # weight.
    upright = make_mechanism_of_nimble(trial, (0.0, -9.81, 0.0))
    residual = compute_moments(trial, upright, with_ground_forces=True) - arrays["moments"]
    weight = 9.81 * mechanism.total_mass
    vertical = residual[1:-1, columns.index("pelvis_ty")]
    np.testing.assert_allclose(vertical, weight, atol=1.0)


def test_moments_of_the_present_nimble_are_those_of_inverse_dynamics(tmp_path: Path) -> None:
    trial = read_b3d(find_data("b3d/results.b3d")).trials[0]
    gravity = (0.0, -9.81, 0.0)
    mechanism = make_mechanism_of_nimble(trial, gravity)
    result = compute_moments(trial, mechanism, with_ground_forces=False)
    (tmp_path / "it.osim").write_text(trial.subject.model_texts[0])
    arrays = trial.read_arrays(0)
    states = [arrays[name].tolist() for name in ("positions", "velocities", "accelerations")]
    expected = np.array(ask_nimble("moments", str(tmp_path / "it.osim"), *states, gravity))
    print(f"largest difference {np.abs(result - expected).max():.1e} N m")
    np.testing.assert_allclose(result, expected, atol=1e-9)
