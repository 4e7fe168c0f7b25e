"""Compare motions and result files with a live OpenSim 4.6."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite import (
    Body,
    ContactHalfSpace,
    ContactSphere,
    CoordinateLimitForce,
    HuntCrossleyForce,
    Model,
)
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.simulation import read_sto
from tests.suite import choose

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
pytestmark = pytest.mark.oracle


def opensim_run(path: Path, to, accuracy, folder: Path, start=None):
    """Return OpenSim's table of states and that of its ForceReporter along a simulation.

    Args:
        path: model file.
        to: final time (s).
        accuracy: accuracy of the integrator.
        folder: folder for the tables.
        start: initial value and speed by the name of the coordinate; others have their defaults.
    """
    opensim.Logger.setLevelString("off")
    model = opensim.Model(str(path))
    reporter = opensim.ForceReporter(model)
    model.addAnalysis(reporter)
    state = model.initSystem()
    for name, (value, speed) in (start or {}).items():
        coordinate = model.updCoordinateSet().get(name)
        coordinate.setValue(state, value, False)
        coordinate.setSpeedValue(state, speed)
    state.setTime(0.0)
    manager = opensim.Manager(model)
    manager.setIntegratorAccuracy(accuracy)
    manager.initialize(state)
    manager.integrate(to)
    opensim.STOFileAdapter.write(manager.getStatesTable(), str(folder / "opensim-states.sto"))
    folder.joinpath("forces").mkdir()
    reporter.printResults("run", str(folder / "forces"), -1.0, ".sto")
    (forces,) = folder.joinpath("forces").iterdir()
    return read_sto(folder / "opensim-states.sto"), read_sto(forces)


def tumbling():
    """Return a free body with three balls in one force and limited joints, above a tilted floor."""
    model = Model(name="tumbling")
    body = model.add(
        Body(
            name="dice",
            mass=2.0,
            mass_center=(0.02, 0.01, 0.0),
            inertia=(0.02, 0.03, 0.025, 0, 0, 0),
        )
    )
    free = osimlite.FreeJoint(name="free")
    for name, coordinate in zip(
        ("rx", "ry", "rz", "tx", "ty", "tz"), free.coordinates, strict=True
    ):
        coordinate.name = name
    free.coordinates[4].default_value = 0.25
    model.add(free.between(model.ground, body))
    tail = model.add(
        Body(
            name="tail", mass=0.5, mass_center=(0.1, 0.0, 0.0), inertia=(0.01, 0.01, 0.01, 0, 0, 0)
        )
    )
    hinge = osimlite.UniversalJoint(name="hinge")
    for name, coordinate in zip(("bend", "swing"), hinge.coordinates, strict=True):
        coordinate.name = name
    model.add(hinge.between(body, tail, at=(0.1, 0.0, 0.0)))
    floor = ContactHalfSpace(name="floor", socket_frame=model.ground, orientation=(0.1, 0.0, -1.5))
    balls = [
        ContactSphere(name=f"ball{n}", socket_frame=body, location=at, radius=0.08)
        for n, at in enumerate(((0.1, -0.1, 0.0), (-0.1, -0.1, 0.1), (-0.1, -0.1, -0.1)))
    ]
    model.add(floor, *balls)
    material = HuntCrossleyForce.ContactParameters(
        geometry=(*balls, floor),
        stiffness=2e5,
        dissipation=0.3,
        static_friction=0.8,
        dynamic_friction=0.4,
    )
    contact = HuntCrossleyForce(name="contact", transition_velocity=0.1)
    contact.contact_parameters.objects.append(material)
    model.add(contact)
    for name in ("bend", "swing"):
        model.add(
            CoordinateLimitForce(
                name=f"{name}_limit",
                coordinate=name,
                upper_limit=20.0,
                lower_limit=-20.0,
                transition=5.0,
                damping=0.01,
            )
        )
    return model


# Initial value and speed of coordinates.
START = {
    "rx": (0.2, 1.0),
    "rz": (0.3, -2.0),
    "tx": (0.0, 0.4),
    "ty": (0.3, -0.5),
    "swing": (0.1, 3.0),
}


@pytest.mark.parametrize(
    ("make", "start", "to"), [(dynamic_walker, {}, 1.0), (tumbling, START, 0.6)]
)
@pytest.mark.parametrize("route", ["mass-matrix", "articulated-body"])
def test_motion_forces_and_labels(make, start, to, route, tmp_path):
    model, to = make(), choose(0.4, 1.0) * to
    osimlite.write(model, tmp_path / "model.osim")
    states, forces = opensim_run(tmp_path / "model.osim", to, 1e-9, tmp_path, start)
    trajectory = osimlite.simulate(
        model,
        to,
        "bullet",
        accuracy=1e-9,
        initial={name: value for name, (value, _) in start.items()},
        initial_speeds={name: speed for name, (_, speed) in start.items()},
        route=route,
    )
    trajectory.write(tmp_path)
    ours, our_forces = read_sto(tmp_path / "states.sto"), read_sto(tmp_path / "forces.sto")
    assert ours.columns == states.columns
    assert our_forces.columns == forces.columns
    assert np.abs(ours.rows[-1] - states.rows[-1]).max() < 1e-5
    assert np.abs(ours.rows[-1, 0::2] - states.rows[-1, 0::2]).max() < 1e-6
    last = np.abs(our_forces.rows[-1] - forces.rows[-1])
    assert last.max() < 1e-4 * max(1.0, np.abs(forces.rows).max())


def test_opensim_takes_our_result_files(tmp_path):
    trajectory = osimlite.simulate(dynamic_walker(), 0.1)
    trajectory.write(tmp_path)
    states = opensim.TimeSeriesTable(str(tmp_path / "states.sto"))
    assert states.getNumRows() == 11
    assert list(states.getColumnLabels())[9] == "/jointset/RightThighToPelvis/RHip_rz/speed"
    forces = opensim.TimeSeriesTable(str(tmp_path / "forces.sto"))
    assert forces.getNumColumns() == 80
    assert opensim.Storage(str(tmp_path / "forces.sto")).getSize() == 11
    # OpenSim can replay the states file.
    osimlite.write(dynamic_walker(), tmp_path / "model.osim")
    model = opensim.Model(str(tmp_path / "model.osim"))
    model.initSystem()
    replay = opensim.StatesTrajectory.createFromStatesTable(model, states)
    assert replay.getSize() == 11


def test_same_steps_at_every_accuracy(tmp_path):
    """The error control is the same as in OpenSim, and therefore the number of steps."""
    model = dynamic_walker()
    osimlite.write(model, tmp_path / "model.osim")
    for index, accuracy in enumerate((1e-3, 1e-5)):
        folder = tmp_path / str(index)
        folder.mkdir()
        states, _ = opensim_run(tmp_path / "model.osim", 1.0, accuracy, folder)
        # The first row is the initial state, not a step.
        assert (
            osimlite.simulate(model, 1.0, accuracy=accuracy).summary["steps"]
            == len(states.times) - 1
        )
