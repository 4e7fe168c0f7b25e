"""Lengths, speeds and moment arms of the paths of a file, beside OpenSim's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import opensim

import osimlite
from osimlite.multibody.constraints import Lock
from tests.oracle.opensim_runs import put


def compare_paths(file: Path, poses: int, seed: int = 0) -> None:
    """Compare at random poses within the ranges of the coordinates, and random speeds; locked coordinates rest.

    Where bodies are tied to each other, the poses are near the default one. Paths whose lengths jump at a pose are left
    out: there rounding decides.
    """
    opensim.Logger.setLevelString("off")
    theirs = opensim.Model(str(file))
    state = theirs.initSystem()
    model = osimlite.read(file)
    paths = osimlite.paths(model)
    infos, tied = paths.mechanism.coordinates, any(item.bodies for item in paths.mechanism.constraints)
    coordinates = [opensim.Coordinate.safeDownCast(theirs.getComponent(info.path)) for info in infos]
    along = [_path(theirs, model, name) for name in paths.names]
    # OpenSim projects speeds to 1e-10 only.
    coupled = 1e-8 if any(not isinstance(item, Lock) for item in paths.mechanism.constraints) else 0.0
    rng = np.random.default_rng(seed)
    for _ in range(poses):
        low, high = np.clip([info.range for info in infos], -2.0, 2.0).reshape(-1, 2).T
        locked, rest = [info.locked for info in infos], paths.mechanism.values({})
        q = np.where(locked, rest, rng.uniform(low, high))
        if tied:
            q = paths.mechanism.assemble(rest + 0.1 * (q - rest))
        u = np.where(locked, 0.0, rng.uniform(-2.0, 2.0, len(infos)))
        put(coordinates, state, q, u)
        theirs.realizeVelocity(state)
        lengths, speeds, arms = paths.lengths(q), paths.speeds(q, u), paths.moment_arms(q)
        shaken = [paths.lengths(q + shift) for shift in (-1e-13, -1e-15, 1e-15, 1e-13)]
        for name, path in zip(paths.names, along, strict=True):
            if any(abs(near[name] - lengths[name]) > 1e-11 for near in shaken):
                continue
            assert abs(lengths[name] - path.getLength(state)) < 1e-12, name
            assert abs(speeds[name] - path.getLengtheningSpeed(state)) < 1e-10, name
            expected = [path.computeMomentArm(state, coordinate) for coordinate in coordinates]
            found = [arms[name].get(info.path, 0.0) for info in infos]
            assert np.allclose(found, expected, rtol=coupled, atol=1e-10, equal_nan=True), name


def _path(theirs, model, owner):
    tree = model.tree()
    found = theirs.getComponent(tree.path_of(tree.by_path[owner].geometry_path))
    return opensim.AbstractGeometryPath.safeDownCast(found)
