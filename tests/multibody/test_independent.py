"""What the kernels find of a mechanism, beside formulas of another kind in numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

import osimlite
from osimlite.errors import OsimliteError
from osimlite.multibody import build_mechanism
from osimlite.multibody.mechanism import Mechanism
from tests.multibody.independent.motion import kinematics
from tests.multibody.strategies import Case, cases

KINEMATICS = ("rotations", "origins", "jacobians", "velocities", "biases")


def same_motion(mechanism: Mechanism, q, u) -> None:
    ours, theirs = mechanism.at(q, u), kinematics(mechanism, q, u)
    for name in KINEMATICS:
        expected = getattr(theirs, name)
        scale = max(1.0, np.abs(expected).max(initial=0.0))
        assert getattr(ours, name) == pytest.approx(expected, abs=1e-12 * scale), name


@given(cases())
def test_random_trees(case: Case):
    same_motion(case.mechanism, case.q, case.u)


@pytest.mark.parametrize("opensim_derivatives", [False, True])
def test_models(corpus, opensim_derivatives):
    tried = 0
    for model in corpus:
        try:
            mechanism = build_mechanism(osimlite.read(model.path), opensim_derivatives=opensim_derivatives)
        except OsimliteError:
            continue
        rng, count = np.random.default_rng(tried), len(mechanism.coordinates)
        same_motion(mechanism, mechanism.values({}) + rng.normal(0.0, 0.2, count), rng.normal(size=count))
        tried += 1
    assert tried > 40
