"""Tests of corpus models in MuJoCo: poses, mass matrices, functions, and complete records of what changes."""

from __future__ import annotations

import mujoco
import numpy as np

import osimlite
from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.translate import to_mjcf
from tests.translate.mjcf.compiled import Compiled
from tests.translate.mjcf.support import assert_refused, off
from tests.translate.support import unaccounted


def random_pose(mechanism: Mechanism, random: np.random.Generator) -> Array:
    """Return a random pose within plausible ranges that fulfils locks and couplers."""
    q = mechanism.values({})
    for index, info in enumerate(mechanism.coordinates):
        low, high = info.range
        if not info.locked:
            q[index] = (
                random.uniform(low, high)
                if 0.0 <= high - low <= 4.0 * np.pi
                else q[index] + random.uniform()
            )
    for coupler in mechanism.constraints:
        if isinstance(coupler, Coupler):
            q[coupler.dependent] = coupler.function.evaluate(q[list(coupler.independent)])[0]
    return q


def run(compiled: Compiled) -> None:
    """Simulate a thousand steps from the default pose; a model that diverges must have a record of the reason."""
    model, data = compiled.model, compiled.data
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    for _ in range(1000):
        mujoco.mj_step(model, data)
    runs = all(
        np.isfinite(each).all() and (np.abs(each) < 1e10).all()
        for each in (data.qpos, data.qvel, data.qacc)
    )
    assert runs or {record.kind for record in compiled.mjcf.fidelity} & {
        "singular",
        "overstretched",
    }


def test_real_models(corpus_model):
    try:
        model = osimlite.read(corpus_model.path)
        mjcf = to_mjcf(model, folder=corpus_model.path.parent)
    except OsimliteError as error:
        assert_refused(corpus_model, error)
        return
    assert unaccounted(model, mjcf) == []
    compiled = Compiled(mjcf)
    if compiled.model.nkey:
        mujoco.mj_resetDataKeyframe(compiled.model, compiled.data, 0)
    mujoco.mj_forward(compiled.model, compiled.data)
    assert np.isfinite(compiled.data.qacc).all()
    run(compiled)

    own, mechanism = Compiled(mjcf, own=True), mjcf.robot.mechanism
    free = [place for place, info in enumerate(mechanism.coordinates) if not info.locked]
    said = {
        record.detail.split()[1]: record.errors["value"].max
        for record in mjcf.fidelity
        if record.kind == "function"
    }
    random = np.random.default_rng(1)
    for _ in range(5):
        q = random_pose(mechanism, random)
        own.place(q)
        state = mechanism.at(q)
        for index, body in enumerate(mechanism.bodies):
            result = own.body(mjcf.robot.link_of[body.path][0].name)
            np.testing.assert_allclose(result, state.transform(index), rtol=0.0, atol=1e-9)
        rates = np.linalg.inv(mechanism.rate_matrix(q))
        wanted = (rates.T @ mechanism.mass_matrix(q) @ rates)[np.ix_(free, free)]
        scale = max(1.0, np.abs(wanted).max(initial=0.0))
        np.testing.assert_allclose(
            own.mass_matrix(q)[np.ix_(free, free)], wanted, rtol=0.0, atol=1e-12 * scale
        )
        for name, difference in off(own, q).items():
            assert abs(difference) <= 1.05 * said.get(name, 0.0) + 1e-12, name
