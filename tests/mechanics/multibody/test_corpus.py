"""Tests of corpus models against OpenSim: poses, markers, mass matrices and assembled default poses."""

from __future__ import annotations

import gzip
import json

import numpy as np
import pytest

from osimlite.errors import SimulationError
from osimlite.io.document.reader import read_text
from osimlite.mechanics.multibody import build_mechanism
from tests.conftest import ROUNDED

_TYPES = (None, "rotational", "translational", "coupled")


def _mechanism_and_truth(corpus_model):
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    truth = json.loads(gzip.decompress(corpus_model.truth.read_bytes()))
    model = read_text(gzip.decompress(corpus_model.converted.read_bytes()).decode())
    return build_mechanism(model), truth


def test_real_models_stand_as_in_opensim(corpus_model):
    mechanism, truth = _mechanism_and_truth(corpus_model)
    assert [info.path for info in mechanism.coordinates] == [
        item["path"] for item in truth["coordinates"]
    ]
    assert [_TYPES.index(info.motion_type) for info in mechanism.coordinates] == [
        item["motion"] for item in truth["coordinates"]
    ]
    assert mechanism.total_mass == pytest.approx(truth["total_mass"], rel=1e-11, abs=1e-15)
    tree_order = [place for body in mechanism.bodies for place in body.mobilizer.coordinates]
    near = ROUNDED.get(corpus_model.id, 1e-10)
    for pose in (truth["default_pose"], truth["pose2"]):
        q = np.array(pose["q"])
        for path, (position, rotation) in pose["body_xform"].items():
            result = mechanism.frame_transform(path, q)
            assert result[:3, 3] == pytest.approx(np.array(position), abs=near)
            assert result[:3, :3].ravel() == pytest.approx(np.array(rotation), abs=near)
        stations = mechanism.station_positions(q)
        for path, position in pose["markers"].items():
            assert stations[path] == pytest.approx(np.array(position), abs=near)
        assert mechanism.center_of_mass(q) == pytest.approx(np.array(pose["com"]), abs=near)
        expected = np.array(pose.get("mass_matrix") or np.nan, dtype=float)
        if np.isfinite(expected).all():
            result = mechanism.mass_matrix(q)[np.ix_(tree_order, tree_order)]
            assert np.abs(result - expected).max() <= max(1e-9, near) * np.abs(expected).max()


def test_default_poses_are_assembled_as_in_opensim(corpus_model):
    mechanism, truth = _mechanism_and_truth(corpus_model)
    q, u = mechanism.default_state()
    assert q == pytest.approx(np.array(truth["default_pose"]["q"]), abs=1e-9)
    state = mechanism.at(q, u)
    for constraint in mechanism.constraints:
        assert np.abs(constraint.position_errors(state)).max(initial=0.0) < 1e-10
        rows, wanted = constraint.velocity_equations(state)
        assert np.abs(rows @ u - wanted).max() < 1e-10


def test_real_models_keep_their_energy(corpus_model):
    """Along the motion, total energy is constant, because gravity is the only force."""
    mechanism, _ = _mechanism_and_truth(corpus_model)
    rng = np.random.default_rng(4)
    q, _ = mechanism.default_state()
    # Avoid the ends of ranges, where splines often end and their second derivatives jump.
    middles = np.array([sum(info.range) / 2.0 for info in mechanism.coordinates])
    moved = [0.0 if info.locked else rng.uniform(0.02, 0.1) for info in mechanism.coordinates]
    q = mechanism.assemble(q + np.sign(middles - q) * moved)
    u = mechanism.project_speeds(q, rng.uniform(-1.0, 1.0, len(q)))
    if corpus_model.id == "m0109":
        with pytest.raises(SimulationError, match="'deviation' moves no mass"):
            mechanism.acceleration(q, u)
        return
    udot = mechanism.acceleration(q, u)
    qdot = mechanism.coordinate_rates(q, u)
    qddot = mechanism.rate_matrix(q) @ udot + mechanism.rate_bias(q, u)

    def energies(t):
        there = q + qdot * t + qddot * t * t / 2.0
        return mechanism.kinetic_energy(there, u + udot * t) + mechanism.potential_energy(there)

    step = 1e-4
    # Central difference of fourth order.
    near, far = (energies(size * step) - energies(-size * step) for size in (1.0, 2.0))
    power = (8.0 * near - far) / (12.0 * step)
    scale = mechanism.kinetic_energy(q, u) + abs(mechanism.gravity_forces(q) @ u)
    rounding = 1e-11 * abs(mechanism.potential_energy(q)) + 1e-15
    assert abs(power) < 1e-8 * scale + rounding
