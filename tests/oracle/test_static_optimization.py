"""Compare static optimization with a live OpenSim.

The effort must never be larger, and the forces must give the accelerations of the motion.
"""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import read_sto
from osimlite.schema.muscles import Muscle
from tests.scripts import run_script

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

CLASSES = ("Thelen2003Muscle", "Millard2012EquilibriumMuscle", "DeGrooteFregly2016Muscle")
# Properties that the new muscles take from the old ones.
KEPT = ("max_isometric_force", "optimal_fiber_length", "tendon_slack_length", "pennation_angle_at_optimal",
        "min_control", "max_control", "geometry_path")  # fmt: skip


@pytest.fixture
def arm(shared: Path, tmp_path: Path) -> Path:
    """Return a folder with OpenSim's own test case: an arm with six muscles and bounded controls."""
    place = shared / "oracle" / "tools" / "reference" / "so_arm26_bounds"
    (tmp_path / "arm26_bounds.osim").write_bytes(
        gzip.decompress((place / "arm26_bounds.osim.gz").read_bytes())
    )
    (tmp_path / "arm26_InverseKinematics.mot").write_bytes(
        (place / "arm26_InverseKinematics.mot").read_bytes()
    )
    text = (place / "arm26_bounds_Setup_StaticOptimization.xml").read_text()
    for results in ("ours", "theirs"):
        own = re.sub("<results_directory>[^<]*<", f"<results_directory>{results}<", text)
        (tmp_path / f"{results}.xml").write_text(own)
    return tmp_path


def with_muscles(file: Path, kind: str) -> None:
    """Replace all muscles of a model file by muscles of another class with the same parameters."""
    model = osimlite.read(file)
    for place, muscle in enumerate(model.force_set.objects):
        if isinstance(muscle, Muscle):
            other = getattr(osimlite, kind)(name=muscle.name)
            for name in KEPT:
                setattr(
                    other,
                    name,
                    getattr(muscle, name).copy_deep()
                    if name == "geometry_path"
                    else getattr(muscle, name),
                )
            model.force_set.objects[place] = other
    osimlite.write(model, file)


def moved(model: osimlite.Model, file: Path, forces: osimlite.simulation.StoTable) -> np.ndarray:
    """Return the accelerations (t, n) of OpenSim's model under given forces along the motion of the setup."""
    motion = osimlite.kinematics(model, file.parent / "arm26_InverseKinematics.mot", lowpass=6.0)
    theirs = opensim.Model(str(file))
    state = theirs.initSystem()
    actuators = [
        opensim.ScalarActuator.safeDownCast(theirs.getForceSet().get(name))
        for name in forces.columns
    ]
    for actuator in actuators:
        actuator.overrideActuation(state, True)
    names = motion.mechanism.coordinate_names
    result = []
    for row, time in zip(forces.rows, forces.times, strict=True):
        at = int(np.argmin(abs(motion.times - time)))
        assert motion.times[at] == pytest.approx(time, abs=1e-12)
        for name, q, u in zip(names, motion.values[at], motion.rates[0][at], strict=True):
            theirs.getCoordinateSet().get(name).setValue(state, float(q), False)
            theirs.getCoordinateSet().get(name).setSpeedValue(state, float(u))
        for actuator, force in zip(actuators, row, strict=True):
            actuator.setOverrideActuation(state, float(force))
        theirs.realizeAcceleration(state)
        result.append(
            [theirs.getCoordinateSet().get(name).getAccelerationValue(state) for name in names]
        )
    return np.array(result)


@pytest.mark.parametrize("kind", CLASSES)
@pytest.mark.parametrize("exponent", [2, 3])
def test_an_arm_with_muscles_of_other_classes(
    arm: Path, monkeypatch: pytest.MonkeyPatch, kind: str, exponent: int
) -> None:
    monkeypatch.chdir(arm)
    with_muscles(arm / "arm26_bounds.osim", kind)
    for results in ("ours", "theirs"):
        text = (arm / f"{results}.xml").read_text()
        (arm / f"{results}.xml").write_text(
            re.sub("(<activation_exponent>)[^<]*<", rf"\g<1>{exponent}<", text)
        )
    done = osimlite.run(arm / "ours.xml", check=False)
    script = "import opensim; opensim.Logger.setLevelString('Error'); assert opensim.AnalyzeTool('theirs.xml').run()"
    run_script(script)
    (ours, our_forces), (theirs, their_forces) = (
        [read_sto(next((arm / folder).glob(f"*_{end}.sto"))) for end in ("activation", "force")]
        for folder in ("ours", "theirs")
    )
    assert ours.columns == theirs.columns and our_forces.columns == their_forces.columns
    solved = ~np.isnan(ours.rows).any(axis=1)
    assert solved.any() and done.done == solved.all()
    x, other = ours.rows[solved], theirs.rows[solved]
    assert (
        np.sum(abs(x) ** exponent, axis=1)
        <= (1.0 + 1e-7) * np.sum(abs(other) ** exponent, axis=1) + 1e-9
    ).all()
    mine = our_forces.rows[solved][:, [our_forces.columns.index(name) for name in ours.columns]]
    yours = their_forces.rows[solved][:, [our_forces.columns.index(name) for name in ours.columns]]
    pulls = abs(x) > 1e-6
    assert (mine[pulls] / x[pulls] * other[pulls]) == pytest.approx(
        yours[pulls], rel=1e-9, abs=1e-8
    )


def test_the_forces_give_the_accelerations_of_the_motion(arm: Path) -> None:
    """OpenSim's model has the accelerations of the motion under these forces."""
    file = arm / "arm26_bounds.osim"
    model = osimlite.read(file)
    found = osimlite.static_optimization(
        model, arm / "arm26_InverseKinematics.mot", lowpass=6.0, start=0.4, end=0.9, folder=arm
    )
    assert found.solved.all() and found.forces is not None and found.motion is not None
    moving = moved(model, file, found.forces)
    around = osimlite.kinematics(model, arm / "arm26_InverseKinematics.mot", lowpass=6.0).around
    assert around is not None
    from osimlite.mechanics.multibody.smoothing_spline import derivatives_of_samples

    (speeds,) = derivatives_of_samples(*around, around[0], (1,), 3)
    (wanted,) = derivatives_of_samples(around[0], speeds, found.times, (1,), 3)
    assert moving == pytest.approx(wanted, rel=1e-9, abs=1e-8)


def test_actuators_in_the_place_of_muscles(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two actuators share one coordinate, a third one drives the other.

    The solution is known analytically; OpenSim's differs from it within its tolerance.
    """
    monkeypatch.chdir(arm)
    own = osimlite.ForceSet(name="own")
    sizes = ("a", "r_shoulder_elev", 10.0), ("b", "r_elbow_flex", 5.0), ("c", "r_elbow_flex", 2.0)
    for name, coordinate, force in sizes:
        own.objects.append(
            osimlite.CoordinateActuator(name=name, coordinate=coordinate, optimal_force=force)
        )
    osimlite.write(own, arm / "own.xml")
    for results in ("ours", "theirs"):
        text = (arm / f"{results}.xml").read_text()
        text = re.sub("<replace_force_set>[^<]*<", "<replace_force_set>true<", text)
        text = re.sub(r"<force_set_files>[^<?]*</", "<force_set_files>own.xml</", text)
        (arm / f"{results}.xml").write_text(text)
    osimlite.run(arm / "ours.xml", check=False)
    script = "import opensim; opensim.Logger.setLevelString('Error'); assert opensim.AnalyzeTool('theirs.xml').run()"
    run_script(script)
    ours, theirs = (
        read_sto(next((arm / folder).glob("*_activation.sto"))) for folder in ("ours", "theirs")
    )
    assert ours.columns == theirs.columns == ("a", "b", "c")
    assert ours["b"] / ours["c"] == pytest.approx(np.full(len(ours.times), 2.5), rel=1e-9)
    assert ours.rows == pytest.approx(theirs.rows, abs=1e-2 * abs(theirs.rows).max())


def test_an_elbow_that_follows_the_shoulder(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A coupler leaves one free coordinate; poses of both programs fulfil it within 1e-9 rad."""
    monkeypatch.chdir(arm)
    model = osimlite.read(arm / "arm26_bounds.osim")
    coupler = osimlite.CoordinateCouplerConstraint(
        name="coupler",
        independent_coordinate_names=("r_shoulder_elev",),
        dependent_coordinate_name="r_elbow_flex",
        coupled_coordinates_function=osimlite.LinearFunction(coefficients=(0.5, 0.1)),
    )
    model.constraint_set.objects.append(coupler)
    osimlite.write(model, arm / "arm26_bounds.osim")
    assert osimlite.run(arm / "ours.xml", check=False).done
    script = "import opensim; opensim.Logger.setLevelString('Error'); assert opensim.AnalyzeTool('theirs.xml').run()"
    run_script(script)
    ours, theirs = (
        read_sto(next((arm / folder).glob("*_activation.sto"))) for folder in ("ours", "theirs")
    )
    assert (np.sum(ours.rows**2, axis=1) <= np.sum(theirs.rows**2, axis=1)).all()
    assert ours.rows == pytest.approx(theirs.rows, abs=5e-3)
