"""Tests of OpenSim models that are translated to MJCF and back."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.models.jumper import jumper
from tests.suite import choose

mujoco = pytest.importorskip("mujoco", reason="needs mujoco (extra 'mujoco')")

from osimlite.translate.mjcf.poses import draw_values  # noqa: E402

LENGTHS = {"gait10dof18musc": 4e-3, "jumper": 1e-3}
"""Largest root mean square error (m) of a path after both translations."""


def there_and_back(model, folder):
    """Translate a model to MJCF and back.

    Args:
        model: OpenSim model.
        folder: folder of the files.

    Returns:
        Model after both translations, and a function that returns values of its coordinates for
        those of the original.
    """
    translated = osimlite.to_mjcf(model, visuals=False)
    file = translated.write(folder)[0]
    made = osimlite.from_mjcf(file, written_for=4)
    compiled = mujoco.MjModel.from_xml_path(str(file))

    def values(q):
        qpos = compiled.qpos0.copy()
        for name, value in translated.joint_values(q).items():
            qpos[compiled.joint(name).qposadr[0]] = value
        return made.coordinates.values(qpos)

    return made, values


def check(model, folder, allowed):
    made, values = there_and_back(model, folder)
    before, after = osimlite.mechanism(model), osimlite.mechanism(made.model)
    paths = [osimlite.paths(item) for item in (model, made.model)]
    errors = {}
    for q in draw_values(before, choose(8, 20), 3):
        poses = before.body_transforms(q), after.body_transforms(values(q))
        for name in poses[0].keys() & poses[1].keys():
            assert np.abs(poses[0][name] - poses[1][name]).max() < 1e-9
        lengths = paths[0].lengths(q), paths[1].lengths(values(q))
        for name in lengths[0].keys() & lengths[1].keys():
            errors.setdefault(name, []).append(lengths[0][name] - lengths[1][name])
    assert all(np.sqrt(np.mean(np.square(row))) < allowed for row in errors.values())
    for muscle in model.force_set.objects:
        path = f"/forceset/{muscle.name}"
        if hasattr(muscle, "tendon_slack_length") and path in errors:
            again = made.model[path]
            cos = np.cos(muscle.pennation_angle_at_optimal)
            assert again.optimal_fiber_length == pytest.approx(muscle.optimal_fiber_length * cos)
            assert again.tendon_slack_length == pytest.approx(muscle.tendon_slack_length)
    masses = [sum(body.mass for body in item.body_set.objects) for item in (model, made.model)]
    assert masses[1] == pytest.approx(masses[0], rel=1e-3)


def test_walker(tmp_path):
    check(dynamic_walker(), tmp_path, 1e-9)


def test_jumper(tmp_path):
    check(jumper(driven=False), tmp_path, LENGTHS["jumper"])


@pytest.mark.full
@pytest.mark.parametrize("name", ["m0005", "m0072", "m0139"])
def test_published_models(corpus, name, tmp_path):
    path = next(item.path for item in corpus if item.id == name)
    check(osimlite.read(path), tmp_path, LENGTHS["gait10dof18musc"])
