"""Bodies and joints, in MuJoCo's own eyes, against the mechanism."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError
from osimlite.translate import to_mjcf
from tests.translate.mjcf.compiled import Compiled


def test_every_real_model_has_the_bodies_and_the_mass_matrix_of_the_mechanism(corpus_model):
    try:
        model = osimlite.read(corpus_model.path)
        mjcf = to_mjcf(model, mujoco=4)
    except OsimliteError as error:
        pytest.skip(f"no mechanism: {error.message[:80]}")
    compiled, mechanism = Compiled(mjcf, own=True), mjcf.robot.mechanism
    random = np.random.default_rng(1)
    free = [place for place in range(len(mechanism.coordinates)) if not mechanism.coordinates[place].locked]
    for _ in range(3):
        q = mechanism.values({})
        q[free] += random.uniform(-0.7, 0.7, len(free))
        compiled.place(q)
        poses = mechanism.body_transforms(q)
        for link in mjcf.robot.links[1:]:
            for path in link.bodies:
                placed = poses[path.rsplit("/", 1)[1]] if path in model.tree().by_path else None
                if placed is not None:
                    np.testing.assert_allclose(compiled.body(link.name), placed, rtol=0.0, atol=1e-9)
        rates = mechanism.rate_matrix(q)
        wanted = (np.linalg.inv(rates).T @ mechanism.mass_matrix(q) @ np.linalg.inv(rates))[np.ix_(free, free)]
        found = compiled.mass_matrix(q)[np.ix_(free, free)]
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-12 * max(1.0, np.abs(wanted).max(initial=0.0)))
