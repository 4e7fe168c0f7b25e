"""A model that can carry any force, and the comparison of its dynamics with a live OpenSim 4.6."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite import Body, Model
from osimlite.mechanics.multibody import build_mechanism
from osimlite.schema.controller_types import PrescribedController
from osimlite.schema.frames import PhysicalOffsetFrame
from osimlite.schema.function_types import Sine
from osimlite.schema.functions import Constant
from osimlite.schema.paths import GeometryPath, PathPoint
from osimlite.simulation.elements import force_elements
from tests.oracle.opensim_runs import put

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")

# Time (s) at which forces are compared.
TIME = 0.37
# Number of random states that are compared.
STATES = 4
# Classes of the three joints of the carrier.
JOINTS = {
    "free, ball, pin": ("FreeJoint", "BallJoint", "PinJoint"),
    "pin, slider, universal": ("PinJoint", "SliderJoint", "UniversalJoint"),
}


def carrier(kinds) -> Model:
    """Return a chain of bodies with one joint of each class in `kinds`.

    Each body carries an offset frame, so that forces can act on frames as well as on bodies.
    """
    model = Model(name="carrier")
    below = model.ground
    for number, kind in enumerate(kinds):
        body = model.add(
            Body(
                name=f"b{number}",
                mass=1.0 + number,
                mass_center=(0.05, -0.1, 0.02),
                inertia=(0.2, 0.3, 0.25, 0.01, -0.02, 0.03),
            )
        )
        body.subcomponents.append(
            PhysicalOffsetFrame(
                name=f"f{number}",
                socket_parent="..",
                translation=(0.1, -0.05, 0.2),
                orientation=(0.3, -0.4, 0.2 + number),
            )
        )
        joint = getattr(osimlite, kind)(name=f"j{number}")
        for index, coordinate in enumerate(joint.coordinates):
            coordinate.name = f"q{number}_{index}"
        at, turned = (0.1, 0.2 * number, -0.05), (0.3, -0.2, 0.1)
        model.add(
            joint.between(
                below, body, at=at, turned=turned, child_at=(0, 0.1, 0.03), child_turned=(0.1, 0, 1)
            )
        )
        below = body
    return model


def compare(model, tmp_path, *, counted=1, tolerance=1e-9):
    """Compare accelerations, force records and energy with OpenSim at random states.

    Args:
        model: model made by `carrier`, with the forces to be compared.
        tmp_path: folder for the model file.
        counted: how often OpenSim counts the potential energy of the forces; None for a model whose
            energy is not compared.
        tolerance: relative tolerance.

    Returns:
        The number of record values that differ from zero.
    """
    busy = 0
    from osimlite.simulation.engines.bullet.engine import BulletEngine

    opensim.Logger.setLevelString("off")
    osimlite.write(model, tmp_path / "model.osim")
    theirs = opensim.Model(str(tmp_path / "model.osim"))
    state = theirs.initSystem()
    mechanism = build_mechanism(model)
    names = mechanism.coordinate_names
    rng = np.random.default_rng(7)
    with BulletEngine(mechanism, force_elements(model, mechanism)) as engine:
        for _ in range(STATES):
            q, u = rng.uniform(-0.9, 0.9, len(names)), rng.uniform(-2.0, 2.0, len(names))
            for index, info in enumerate(mechanism.coordinates):
                if info.locked:
                    q[index], u[index] = info.default_value, 0.0
            put(map(theirs.getCoordinateSet().get, names), state, q, u)
            state.setTime(TIME)
            theirs.realizeAcceleration(state)
            expected = [
                theirs.getCoordinateSet().get(name).getAccelerationValue(state) for name in names
            ]
            ours = engine.compute_accelerations(TIME, q.tolist(), u.tolist())
            scale = max(1.0, np.abs(expected).max())
            assert np.abs(np.subtract(ours, expected)).max() <= tolerance * scale
            labels, values = [], []
            forces = theirs.getForceSet()
            for number in range(forces.getSize()):
                result, row = (
                    forces.get(number).getRecordLabels(),
                    forces.get(number).getRecordValues(state),
                )
                labels += [result.get(index) for index in range(result.getSize())]
                values += [row.get(index) for index in range(result.getSize())]
            busy += np.count_nonzero(values)
            y = engine.state.pack(q, u)
            assert list(engine.columns) == labels
            recorded = engine.force_records(TIME, y)
            assert recorded == pytest.approx(
                values, rel=tolerance, abs=tolerance * max(1.0, *map(abs, [0, *values]))
            )
            if counted is not None:
                kinetic, gravity, stored = engine.compute_energies(TIME, y)
                assert kinetic == pytest.approx(theirs.calcKineticEnergy(state), rel=1e-10)
                total = theirs.calcPotentialEnergy(state)
                assert gravity + counted * stored == pytest.approx(total, rel=1e-9, abs=1e-9)
    return busy


# Frames that two-frame forces connect.
PAIRS = (
    ("/ground", "/bodyset/b2/f2"),
    ("/bodyset/b1/f1", "/bodyset/b0"),
    ("/bodyset/b0/f0", "/bodyset/b1/f1"),
)
DAMPING = {"rotational_damping": (0.3, 0.2, 0.1), "translational_damping": (2.0, 1.0, 3.0)}


def between(kind, **more):
    return [
        kind(name=f"bushing{number}", socket_frame1=one, socket_frame2=two, **more)
        for number, (one, two) in enumerate(PAIRS)
    ]


# Points of the paths of path forces: frame and location (m).
ROUTES = (
    (("/ground", (1.0, 0.5, 0.2)), ("/bodyset/b2", (0.1, 0.2, 0.3))),
    (
        ("/bodyset/b1/f1", (0.1, 0.0, 0.2)),
        ("/bodyset/b1", (0.3, 0.2, 0.0)),
        ("/bodyset/b0", (0.0, 0.4, 0.1)),
        ("/ground", (-0.5, 0.1, 0.0)),
        ("/bodyset/b2/f2", (0.2, 0.1, 0.0)),
    ),
)


def along(kind, **more):
    result = []
    for number, route in enumerate(ROUTES):
        force = kind(name=f"along{number}", **more)
        path = GeometryPath(name="path")
        for index, (frame, at) in enumerate(route):
            path.path_point_set.objects.append(
                PathPoint(name=f"p{index}", socket_parent_frame=frame, location=at)
            )
        force.geometry_path = path
        result.append(force)
    return result


def drive(model, *names):
    """Add controllers that prescribe the controls of actuators as functions of time.

    The first actuator gets a second controller, because OpenSim adds up controls. A disabled
    controller must have no effect.
    """
    functions = [Sine(amplitude=0.5, omega=3.0, phase=0.1, offset=1.0), Constant(value=-2.0)]
    paths = [f"/forceset/{name}" for name in names]
    for number, function in enumerate(functions):
        controller = PrescribedController(name=f"c{number}", socket_actuators=tuple(paths))
        controller.ControlFunctions.objects += [function.model_copy() for _ in paths]
        model.add(controller)
        paths = paths[:1]
    off = PrescribedController(name="off", socket_actuators=tuple(paths), enabled=False)
    off.ControlFunctions.objects.append(Constant(value=100.0))
    model.add(off)
