"""Compare poses, mass matrices and accelerations of corpus models with a live OpenSim 4.6.

All forces but gravity are removed.
"""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from osimlite.errors import SimulationError
from osimlite.io.document.reader import read_text
from osimlite.mechanics.multibody import Mechanism, build_mechanism
from osimlite.mechanics.multibody.constraints import Lock
from tests.oracle.opensim_runs import put

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

# Models whose knees have several rotations that depend on one coordinate.
_SEVERAL_ROTATIONS = {"m0097", "m0116", "m0225", "m0954"}


def _without_forces(path: Path) -> tuple[Any, Any]:
    """Load a model in its default pose at rest, with no forces but gravity and constraints.

    Returns:
        OpenSim's model and state.
    """
    opensim.Logger.setLevelString("off")
    model = opensim.Model(str(path))
    for part in ("ForceSet", "ControllerSet", "ProbeSet"):
        getattr(model, f"upd{part}")().clearAndDestroy()
    model.finalizeFromProperties()
    try:
        state = model.initSystem()
    except RuntimeError as problem:
        pytest.skip(f"OpenSim needs the forces of this model: {problem}")
    for component in model.getComponentsList():
        force = opensim.Force.safeDownCast(component)
        if force:
            force.setAppliesForce(state, False)
    return model, state


def _random_state(mechanism: Mechanism, rng: np.random.Generator) -> tuple[Any, Any]:
    q, _ = mechanism.default_state()
    moved = [0.0 if info.locked else rng.uniform(-0.2, 0.2) for info in mechanism.coordinates]
    q = mechanism.assemble(q + moved)
    return q, mechanism.project_speeds(q, rng.uniform(-1.0, 1.0, len(q)))


def _assign(model: Any, state: Any, q: Any, u: Any) -> list[Any]:
    coordinates = [model.getCoordinateSet().get(index) for index in range(len(q))]
    put(coordinates, state, q, u)
    return coordinates


def test_real_models_move_as_in_opensim(corpus_model: Any, tmp_path: Path) -> None:
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    text = gzip.decompress(corpus_model.converted.read_bytes()).decode()
    path = tmp_path / "model.osim"
    path.write_text(text)
    model, state = _without_forces(path)
    read = read_text(text)
    ours, theirs = build_mechanism(read), build_mechanism(read, opensim_derivatives=True)
    rng = np.random.default_rng(3)
    for _ in range(3):
        q, u = _random_state(ours, rng)
        coordinates = _assign(model, state, q, u)
        model.realizeAcceleration(state)
        _same_bodies(model, state, ours, q, u)
        expected = np.array([item.getAccelerationValue(state) for item in coordinates])
        if len(q) and ours.total_mass == 0.0:
            assert np.isnan(expected).all()
            with pytest.raises(SimulationError, match="moves no mass"):
                ours.acceleration(q, u)
            continue
        scale = 1e-3 + np.abs(expected).max(initial=0.0)
        assert np.abs(theirs.acceleration(q, u) - expected).max(initial=0.0) < 1e-10 * scale
        apart = np.abs(ours.acceleration(q, u) - expected).max(initial=0.0) / scale
        if corpus_model.id in _SEVERAL_ROTATIONS:
            assert 1e-6 < apart < 1e-2
        else:
            assert apart < 1e-10


def _same_bodies(model: Any, state: Any, mechanism: Mechanism, q: Any, u: Any) -> None:
    kinematics = mechanism.at(q, u)
    for index, body in enumerate(mechanism.bodies):
        their_body = opensim.Body.safeDownCast(model.getComponent(body.path))
        position = their_body.getPositionInGround(state).to_numpy()
        assert kinematics.origins[index] == pytest.approx(position, abs=1e-11)
        velocity = their_body.getVelocityInGround(state)
        expected = np.concatenate([velocity.get(part).to_numpy() for part in (0, 1)])
        assert kinematics.velocities[index] == pytest.approx(
            expected, abs=1e-9 * (1.0 + np.abs(expected).max())
        )
    if mechanism.total_mass == 0.0:
        return
    assert mechanism.center_of_mass(q) == pytest.approx(
        model.calcMassCenterPosition(state).to_numpy(), abs=1e-11
    )
    energy = model.calcKineticEnergy(state)
    assert mechanism.kinetic_energy(q, u) == pytest.approx(energy, rel=1e-10, abs=1e-12)


def test_real_models_assemble_as_in_opensim(corpus_model: Any, tmp_path: Path) -> None:
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    text = gzip.decompress(corpus_model.converted.read_bytes()).decode()
    mechanism = build_mechanism(read_text(text))
    if all(isinstance(item, Lock) for item in mechanism.constraints):
        pytest.skip("nothing to assemble")
    path = tmp_path / "model.osim"
    path.write_text(text)
    model, state = _without_forces(path)
    rng = np.random.default_rng(1)
    q, _ = mechanism.default_state()
    for index, info in enumerate(mechanism.coordinates):
        if not info.locked:
            q[index] += rng.uniform(-0.1, 0.1)
        if info.clamped:
            q[index] = np.clip(q[index], *info.range)
    coordinates = _assign(model, state, q, 0.0 * q)
    model.assemble(state)
    theirs, ours = np.array([item.getValue(state) for item in coordinates]), mechanism.assemble(q)
    ends = [info.range for info in mechanism.coordinates if info.clamped]
    at_an_end = any(np.isclose(ours, end, atol=1e-9).any() for pair in ends for end in pair)
    # OpenSim's optimizer stays slightly off the ends of coordinate ranges.
    assert ours == pytest.approx(theirs, abs=1e-4 if at_an_end else 1e-8)
