"""Compare accelerations of both engines with osimlite's recursive algorithm on corpus models."""

from __future__ import annotations

import gzip
from dataclasses import replace

import numpy as np
import pytest

from osimlite.errors import SimulationError
from osimlite.io.document.reader import read_text
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.constraints import Lock
from osimlite.simulation.elements import Forces, force_elements
from osimlite.simulation.engines.protocol import EngineSettings

pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")

from osimlite.simulation.engines.bullet.engine import make_engine
from osimlite.simulation.engines.compiled import CompiledEngine


def largest_difference(ours, expected):
    return np.abs(np.subtract(ours, expected)).max(initial=0.0) / max(
        1.0, np.abs(expected).max(initial=0.0)
    )


def state_near(mechanism, seed):
    """Return a random state near the default one, with locked coordinates at rest.

    Returns:
        Coordinates and speeds.
    """
    rng = np.random.default_rng(seed)
    q = np.array([info.default_value for info in mechanism.coordinates])
    free = np.array([not info.locked for info in mechanism.coordinates])
    q = q + free * rng.uniform(-0.05, 0.05, len(q))
    return q, free * rng.uniform(-0.5, 0.5, len(q))


def test_same_accelerations(corpus_model):
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    model = read_text(gzip.decompress(corpus_model.converted.read_bytes()).decode())
    mechanism = build_mechanism(model)
    # Other tests cover constraints.
    locks = tuple(item for item in mechanism.constraints if isinstance(item, Lock))
    mechanism = replace(mechanism, constraints=locks)
    bare = CompiledEngine(mechanism, Forces(()))
    scale = conditioning(mechanism)
    for seed in range(2):
        q, u = state_near(mechanism, seed)
        try:
            result = bare.compute_accelerations(0.0, q, u)
        except SimulationError:
            with pytest.raises(SimulationError, match="no mass"):
                mechanism.acceleration(q, u)
            return
        assert largest_difference(result, mechanism.acceleration(q, u)) < 1e-9 * scale
    forces = force_elements(
        model, mechanism, skip_unsupported=True, folder=corpus_model.path.parent
    )
    ours, theirs = (
        CompiledEngine(mechanism, forces),
        make_engine(mechanism, forces, EngineSettings()),
    )
    with theirs:
        for seed in range(2):
            q, u = (values.tolist() for values in state_near(mechanism, seed))
            difference = largest_difference(
                ours.compute_accelerations(0.1, q, u), theirs.compute_accelerations(0.1, q, u)
            )
            assert difference < 1e-9 * scale
            assert ours.force_records(0.1, ours.state.pack(q, u)) == pytest.approx(
                theirs.force_records(0.1, theirs.state.pack(q, u)), rel=1e-7, abs=1e-7
            )


def test_same_accelerations_under_constraints(corpus_model):
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    model = read_text(gzip.decompress(corpus_model.converted.read_bytes()).decode())
    mechanism = build_mechanism(model)
    if all(isinstance(item, Lock) for item in mechanism.constraints):
        pytest.skip("the model has no constraints")
    forces = force_elements(
        model, mechanism, skip_unsupported=True, folder=corpus_model.path.parent
    )
    ours, theirs = (
        CompiledEngine(mechanism, forces),
        make_engine(mechanism, forces, EngineSettings()),
    )
    y = ours.state.pack(*state_near(mechanism, 3))
    result = ours.project_state(0.1, y, 1e-10)
    assert result is not None
    q, u = ours.state.values(result), ours.state.speeds(result)
    with theirs:
        try:
            expected = theirs.compute_accelerations(0.1, q, u)
        except SimulationError as error:
            with pytest.raises(SimulationError, match="no mass"):
                ours.compute_accelerations(0.1, q, u)
            assert "no mass" in str(error)
            return
        assert largest_difference(
            ours.compute_accelerations(0.1, q, u), expected
        ) < 1e-9 * conditioning(mechanism)
        assert ours.force_records(0.1, ours.state.pack(q, u)) == pytest.approx(
            theirs.force_records(0.1, theirs.state.pack(q, u)), rel=1e-7, abs=1e-7
        )


def conditioning(mechanism):
    """Return the factor by which rounding errors may exceed the usual tolerance.

    It is a thousandth of the condition number of the scaled mass matrix, at least 1.
    """
    q, _ = state_near(mechanism, 0)
    matrix = mechanism.mass_matrix(q)
    free = [
        index
        for index, info in enumerate(mechanism.coordinates)
        if not info.locked and matrix[index, index] > 0
    ]
    if not free:
        return 1.0
    own = matrix[np.ix_(free, free)]
    size = 1.0 / np.sqrt(np.diag(own))
    return max(1.0, np.linalg.cond(own * np.outer(size, size)) * 1e-3)
