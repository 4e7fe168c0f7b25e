"""Tests of public MuJoCo models, converted and compared in osimlite and in OpenSim at 100 random poses.

The models are not part of the repository. Clone MyoHub/myo_sim as ``myo_sim`` and
google-deepmind/mujoco as ``mujoco`` into a folder, and name it in OSIMLITE_PUBLIC_MODELS.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

import osimlite

mujoco = pytest.importorskip("mujoco", reason="needs mujoco (extra 'mujoco')")

from osimlite.translate.mjcf_import.convert import Osim  # noqa: E402
from osimlite.translate.mjcf_import.poses import compute_poses, sample_qpos  # noqa: E402
from osimlite.translate.mjcf_import.source import load_mjcf  # noqa: E402
from osimlite.translate.mjcf_import.tendon_lengths import (  # noqa: E402
    read_tendon,
    tendon_lengths,
)
from tests.translate.mjcf_import import comparison, models  # noqa: E402

pytestmark = pytest.mark.full

POSES = 100


class Case(NamedTuple):
    """Public model and the tolerances of its paths."""

    file: str
    median_length: float  # median over tendons of the root mean square error, m
    worst_length: float  # worst root mean square error of a tendon, m
    median_force: float = 0.05  # median over muscles, relative to the isometric force


CASES = {
    "elbow": Case("myo_sim/elbow/myoelbow_2dof6muscles.xml", 1e-6, 1e-5),
    "finger": Case("myo_sim/finger/myofinger_v0.xml", 1e-12, 2e-5, 0.1),
    "hand": Case("myo_sim/hand/myohand.xml", 1e-6, 2e-4),
    "arm": Case("myo_sim/arm/myoarm.xml", 1e-6, 4e-3),
    "legs": Case("myo_sim/leg/myolegs.xml", 1e-9, 2e-4),
    "torso": Case("myo_sim/torso/myotorso.xml", 1e-9, 3e-4),
    "humanoid": Case("mujoco/model/humanoid/humanoid.xml", 0.0, 0.0),
}


@pytest.fixture(scope="module", params=CASES)
def case(request) -> tuple[Case, Osim]:
    """Convert a public model by the rules of the installed version of MuJoCo.

    Returns:
        Case with the tolerances, and the conversion.
    """
    case = CASES[request.param]
    version = int(mujoco.__version__.split(".")[0])
    return case, osimlite.from_mjcf(models.public(case.file), written_for=version)


def test_bodies_and_masses(case):
    path = models.public(case[0].file)
    assert comparison.pose_errors(path, case[1], POSES) < 1e-9
    assert comparison.mass_errors(path, case[1], 20) < 1e-9


def test_every_tendon_and_actuator_is_accounted_for(case):
    model = mujoco.MjModel.from_xml_path(str(models.public(case[0].file)))
    account = case[1].fidelity
    known = account.translated.keys() | {record.component for record in account}
    for kind, number, count in (
        ("tendon", mujoco.mjtObj.mjOBJ_TENDON, model.ntendon),
        ("actuator", mujoco.mjtObj.mjOBJ_ACTUATOR, model.nu),
        ("equality", mujoco.mjtObj.mjOBJ_EQUALITY, model.neq),
        ("site", mujoco.mjtObj.mjOBJ_SITE, model.nsite),
        ("geom", mujoco.mjtObj.mjOBJ_GEOM, model.ngeom),
    ):
        for index in range(count):
            name = mujoco.mj_id2name(model, number, index) or f"{kind}_{index}"
            assert f"/{kind}/{name}" in known, name


def test_lengths_and_forces_in_osimlite(case):
    """The poses differ from those that the conversion used for its fits."""
    expected, made = case
    source = load_mjcf(models.public(expected.file))
    model = source.model
    if not model.ntendon:
        pytest.skip("no tendons")
    qpos = sample_qpos(source, POSES, 77)
    tendons = [read_tendon(source, index) for index in range(model.ntendon)]
    truth = tendon_lengths(source, tendons, compute_poses(source, qpos), source.major)
    data, paths = mujoco.MjData(model), osimlite.paths(made.model)
    lengths = [paths.lengths(made.coordinates.values(pose)) for pose in qpos]
    errors = []
    for actuator in range(model.nu):
        name = f"/forceset/{model.actuator(actuator).name}"
        if int(model.actuator_trntype[actuator]) != 3 or name not in lengths[0]:
            continue
        tendon = int(model.actuator_trnid[actuator, 0])
        if tendons[tendon].is_fixed:
            continue
        off = np.array([row[name] for row in lengths]) - truth[tendon]
        errors.append(float(np.sqrt(np.mean(off**2))))
    for pose, column in zip(qpos[:10], truth.T, strict=False):
        data.qpos[:] = pose
        mujoco.mj_fwdPosition(model, data)
        assert np.abs(data.ten_length - column).max() < 1e-9
    if errors:
        assert np.median(errors) <= expected.median_length
        assert max(errors) <= expected.worst_length
        forces = [
            record.errors["force"].rms for record in made.fidelity if "force" in record.errors
        ]
        assert np.median(forces) <= expected.median_force


@pytest.mark.oracle
def test_bodies_and_lengths_in_opensim(case, tmp_path):
    pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
    expected, made = case
    source = load_mjcf(models.public(expected.file))
    live = comparison.LiveModel(made, tmp_path)
    data, paths = mujoco.MjData(source.model), osimlite.paths(made.model)
    muscles = {muscle.getName(): muscle for muscle in live.model.getMuscles()}
    for pose in sample_qpos(source, POSES, 78):
        data.qpos[:] = pose
        mujoco.mj_fwdPosition(source.model, data)
        values = made.coordinates.values(pose)
        live.place(values)
        for body, name in comparison.body_names(source.model, made):
            position, rotation = live.body(name)
            assert np.abs(position - data.xpos[body]).max() < 1e-9
            assert np.abs(rotation - data.xmat[body].reshape(3, 3)).max() < 1e-9
        lengths = paths.lengths(values)
        for name, muscle in muscles.items():
            # OpenSim and osimlite compute the same lengths.
            theirs = muscle.getPath().getLength(live.state)
            assert theirs == pytest.approx(lengths[f"/forceset/{name}"], rel=0, abs=1e-6), name
