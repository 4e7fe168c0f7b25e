from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from osimlite.errors import DocumentError, ModelError, SettingError
from osimlite.io.tables.storage import write_sto
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import rotation_xyz
from osimlite.schema.actuators import CoordinateActuator
from osimlite.schema.forces import Force
from osimlite.schema.frames import Body
from osimlite.schema.joint_types import BallJoint
from osimlite.schema.joints import PinJoint
from osimlite.schema.markers import Marker
from osimlite.schema.model import Model
from osimlite.schema.muscles import Thelen2003Muscle
from osimlite.schema.path_forces import PathSpring
from osimlite.schema.sets import ObjectGroup
from osimlite.simulation.recorded_motion import RecordedMotion, exclude_forces


@pytest.fixture(scope="module")
def arm() -> Mechanism:
    """Return the mechanism of a body on a ball joint and a second one on a pin."""
    model = Model(name="arm")
    inner, outer = (
        model.add(
            Body(
                name=name,
                mass=1.3,
                mass_center=(0.1, -0.2, 0.05),
                inertia=(0.2, 0.3, 0.25, 0.01, 0.0, 0.02),
            )
        )
        for name in ("inner", "outer")
    )
    for kind, name, parent, child in (
        (BallJoint, "shoulder", model.ground, inner),
        (PinJoint, "elbow", inner, outer),
    ):
        joint = model.add(
            kind(name=name).between(parent, child, at=(0.1, 0.3, 0.2), turned=(0.4, 0.1, 0.2))
        )
        for index, coordinate in enumerate(joint.coordinates):
            coordinate.name = f"{name}_{index}"
    model.add(Marker(name="tip", socket_parent_frame=outer, location=(0.1, 0.2, 0.3)))
    return build_mechanism(model)


def _motion(mechanism: Mechanism, times: np.ndarray) -> np.ndarray:
    places = range(len(mechanism.coordinates))
    return np.array([0.3 * np.sin((1.0 + 0.3 * k) * times + k) for k in places]).T


def _exact_forces(mechanism: Mechanism, time: float) -> np.ndarray:
    step = 1e-3
    q, before, after = (
        _motion(mechanism, np.array((time + shift,)))[0] for shift in (0.0, -step, step)
    )
    far = [_motion(mechanism, np.array((time + shift,)))[0] for shift in (-2 * step, 2 * step)]
    qdot = (8.0 * (after - before) - (far[1] - far[0])) / (12.0 * step)
    qddot = (16.0 * (after + before) - (far[0] + far[1]) - 30.0 * q) / (12.0 * step**2)
    u = mechanism.speeds_from_rates(q, qdot)
    return mechanism.inverse_dynamics(
        q, u, mechanism.speeds_from_rates(q, qddot - mechanism.rate_bias(q, u))
    )


def test_forces_of_a_known_motion(arm):
    times = np.linspace(0.0, 3.0, 601)
    motion = RecordedMotion(arm, times, _motion(arm, times))
    table = motion.inverse_dynamics()
    assert table.columns == (
        "shoulder_0_moment",
        "shoulder_1_moment",
        "shoulder_2_moment",
        "elbow_0_moment",
    )
    for row in (150, 192, 300, 384, 450):
        assert table.rows[row] == pytest.approx(_exact_forces(arm, times[row]), abs=1e-6)


def test_where_bodies_and_markers_are(arm):
    times = np.array((0.0, 0.4))
    motion = RecordedMotion(arm, times, _motion(arm, times))
    bodies, markers = motion.bodies(), motion.markers()
    assert bodies.in_degrees
    for row, q in enumerate(motion.values):
        state = arm.at(q)
        for index, body in enumerate(arm.bodies):
            place, angles = (
                [bodies[f"{body.name}_{word}"][row] for word in words]
                for words in (("X", "Y", "Z"), ("Ox", "Oy", "Oz"))
            )
            assert place == pytest.approx(
                state.point(index, body.mass_properties.center), abs=1e-14
            )
            assert rotation_xyz(np.radians(angles)) == pytest.approx(
                state.rotations[index], abs=1e-14
            )
        tip = [markers[f"tip_{axis}"][row] for axis in "XYZ"]
        assert tip == pytest.approx(arm.station_position("outer", (0.1, 0.2, 0.3), q), abs=1e-14)
        assert bodies.rows[row, -3:] == pytest.approx(arm.center_of_mass(q), abs=1e-14)


def test_files_name_coordinates_in_either_way_and_in_degrees(arm, tmp_path: Path):
    path = tmp_path / "motion.mot"
    states = (
        "/jointset/shoulder/shoulder_1/value",
        "/jointset/elbow/elbow_0/speed",
        "/forceset/biceps/activation",
    )
    rows = [[90.0, 0.0, 1.0, 0.5, 2.0], [45.0, 30.0, 3.0, 0.5, 4.0]]
    write_sto(path, "motion", [0.0, 0.1], ("elbow_0", *states, "emg"), rows, in_degrees=True)
    motion = RecordedMotion.read(arm, path)
    assert motion.values[:, 3] == pytest.approx(np.radians((90.0, 45.0)))
    assert motion.values[:, 1] == pytest.approx(np.radians((0.0, 30.0)))
    assert (motion.missing, motion.ignored) == (("shoulder_0", "shoulder_2"), ("emg",))


def test_what_is_no_motion_is_refused(arm, tmp_path: Path):
    path = tmp_path / "motion.mot"
    write_sto(path, "motion", [0.0, 0.1], ("knee",), [[1.0], [2.0]])
    with pytest.raises(
        DocumentError, match="no column is a coordinate of 'arm', which has shoulder_0"
    ):
        RecordedMotion.read(arm, path)
    with pytest.raises(ModelError, match="'stone' has no coordinates"):
        RecordedMotion.read(build_mechanism(Model(name="stone")), path)
    write_sto(path, "motion", [0.0, 0.2, 0.1], ("elbow_0",), [[1.0], [2.0], [3.0]])
    with pytest.raises(DocumentError, match=r"the time 0\.1 does not come after 0\.2"):
        RecordedMotion.read(arm, path)
    for times, row in (((0.0, math.inf), 2), ((-1e308, 0.1), 1), ((math.nan, 0.1), 1)):
        write_sto(path, "motion", times, ("elbow_0",), [[1.0], [2.0]])
        with pytest.raises(DocumentError, match=rf"the time of row {row} is .* s; correct it"):
            RecordedMotion.read(arm, path)
    write_sto(
        path,
        "motion",
        [0.0, 0.1],
        ("emg", "elbow_0"),
        [[float("nan"), 1.0], [0.0, float("nan")]],
        has_missing=True,
    )
    with pytest.raises(DocumentError, match=r"'elbow_0' is nan at 0\.1 s; fill the gaps"):
        RecordedMotion.read(arm, path)
    write_sto(path, "motion", [0.0, 0.1, 0.2], ("elbow_0",), [[1.0], [2.0], [3.0]])
    with pytest.raises(SettingError, match="the motion has 3 times; accelerations need at least 6"):
        RecordedMotion.read(arm, path).inverse_dynamics()


def test_forces_are_excluded_by_name_by_group_and_by_kind():
    model = Model(name="m")
    for name in ("one", "two", "three"):
        model.add(PathSpring(name=name))
    model.add(CoordinateActuator(name="motor"))
    model.add(Thelen2003Muscle(name="soleus"))
    model.force_set.groups.append(ObjectGroup(name="pair", members=("one", "two")))

    def on() -> list[str]:
        return [force.name for force in model.components(Force) if force.appliesForce]

    exclude_forces(model, ["three"])
    assert on() == ["one", "two", "motor", "soleus"]
    exclude_forces(model, ["muscles", "pair"])
    assert on() == ["motor"]
    exclude_forces(model, ["Actuators"])
    assert on() == []
    with pytest.raises(
        SettingError, match="no force and no group of forces 'solus'; did you mean 'soleus'"
    ):
        exclude_forces(model, ["solus"])
