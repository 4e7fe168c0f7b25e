"""Compare lengths, lengthening speeds and moment arms of the paths of a file with OpenSim's."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import opensim

import osimlite
from osimlite.mechanics.multibody.constraints import Lock
from osimlite.schema.wrapping import WrapObject
from tests.oracle.opensim_runs import put

JUMP = 1e-11
"""Change of length (m) between two poses 1e-13 apart above which a path counts as discontinuous there."""


def compare_paths(file: Path, poses: int, seed: int = 0) -> None:
    """Compare all paths at random poses within the coordinate ranges and at random speeds.

    Locked coordinates keep their values. Models with constraints between bodies stay near the
    default pose.

    Paths whose length is discontinuous at a pose, here or in OpenSim, are skipped, because rounding
    decides the result there. For the same reason, paths are skipped whose lengths differ and jump
    when the wrap objects move by 1e-15 m. Where a path amplifies rounding, the tolerance is the
    change of length between poses that are hardly apart. Where OpenSim's length is NaN, osimlite
    must have no length either. Where points of two bodies coincide, OpenSim's moment arms are NaN,
    and osimlite's must be numbers.
    """
    opensim.Logger.setLevelString("off")
    theirs = opensim.Model(str(file))
    state = theirs.initSystem()
    model = osimlite.read(file)
    paths = osimlite.paths(model)
    infos, tied = (
        paths.mechanism.coordinates,
        any(item.bodies for item in paths.mechanism.constraints),
    )
    coordinates = [
        opensim.Coordinate.safeDownCast(theirs.getComponent(info.path)) for info in infos
    ]
    along = [_path(theirs, model, name) for name in paths.names]
    # OpenSim projects speeds onto the constraints with an accuracy of 1e-10 only.
    coupled = (
        1e-8 if any(not isinstance(item, Lock) for item in paths.mechanism.constraints) else 0.0
    )
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
        nearby = [q + shift for shift in (-1e-13, -1e-15, 1e-15, 1e-13)]
        shaken = [paths.lengths(near) for near in nearby]
        for name, path in zip(paths.names, along, strict=True):
            ours, length = np.array([near[name] for near in shaken]), path.getLength(state)
            if _jumps(ours, lengths[name]):
                continue
            if not np.isclose(lengths[name], length, rtol=0.0, atol=1e-12, equal_nan=True):
                theirs_nearby = _lengths(path, theirs, coordinates, state, nearby, u)
                put(coordinates, state, q, u)
                theirs.realizeVelocity(state)
                if _jumps(theirs_nearby, length):
                    continue
                spread = np.max(np.abs([ours - lengths[name], theirs_nearby - length]))
                if abs(lengths[name] - length) >= 1e-12 + spread:
                    # Poses do not shake a segment whose ends do not move relative to the surface.
                    moved = _lengths_beside_moved_surfaces(file, name, q)
                    assert any(map(_jumps, moved, (lengths[name], length))), name
                    continue
            assert abs(speeds[name] - path.getLengtheningSpeed(state)) < 1e-10, name
            expected = [path.computeMomentArm(state, coordinate) for coordinate in coordinates]
            result = [arms[name].get(info.path, 0.0) for info in infos]
            if np.isnan(expected).any() and _coincide(path, state):
                assert np.isfinite(result).all(), name
                continue
            assert np.allclose(result, expected, rtol=coupled, atol=1e-10, equal_nan=True), name


def _jumps(nearby: np.ndarray, length: float) -> bool:
    return not np.allclose(nearby, length, rtol=0.0, atol=JUMP, equal_nan=True)


def _lengths(path, theirs, coordinates, state, poses, u) -> np.ndarray:
    """Return OpenSim's lengths (m) of a path at several poses."""
    result = []
    for q in poses:
        put(coordinates, state, q, u)
        theirs.realizePosition(state)
        result.append(path.getLength(state))
    return np.array(result)


def _lengths_beside_moved_surfaces(file: Path, name: str, q: np.ndarray) -> np.ndarray:
    """Return the lengths (m) of a path, by osimlite and by OpenSim, after moves of all wrap objects by up to 1e-15 m."""
    result = []
    for shift in [size * row for size in (1e-16, 1e-15) for row in (*np.eye(3), *-np.eye(3))]:
        model = osimlite.read(file)
        for surface in model.components(WrapObject):
            surface.translation = tuple((np.array(surface.translation) + shift).tolist())
        with TemporaryDirectory() as folder:
            osimlite.write(model, Path(folder) / "moved.osim")
            theirs = opensim.Model(str(Path(folder) / "moved.osim"))
        state, paths = theirs.initSystem(), osimlite.paths(model)
        infos = paths.mechanism.coordinates
        coordinates = [
            opensim.Coordinate.safeDownCast(theirs.getComponent(info.path)) for info in infos
        ]
        put(coordinates, state, q, np.zeros(len(infos)))
        theirs.realizePosition(state)
        result.append([paths.lengths(q)[name], _path(theirs, model, name).getLength(state)])
    return np.array(result).T


def _coincide(path, state) -> bool:
    """Return whether two consecutive points of a path in OpenSim are on two bodies and coincide exactly."""
    geometry = opensim.GeometryPath.safeDownCast(path)
    if geometry is None:
        return False  # a FunctionBasedPath has no points
    points = geometry.getCurrentPath(state)
    # OpenSim sets the direction between points of one body to 0, and between bodies to NaN.
    items = [
        (
            point.getParentFrame().findBaseFrame().getAbsolutePathString(),
            point.getLocationInGround(state).to_numpy(),
        )
        for point in map(points.get, range(points.getSize()))
    ]
    return any(
        first[0] != second[0] and np.array_equal(first[1], second[1])
        for first, second in pairwise(items)
    )


def _path(theirs, model, owner):
    tree = model.tree()
    result = theirs.getComponent(tree.path_of(tree.by_path[owner].geometry_path))
    return opensim.AbstractGeometryPath.safeDownCast(result)
