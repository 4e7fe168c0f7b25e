"""Compare the linter's measurements of paths and muscles with OpenSim's values for the same poses.

As a script: ``python -m tests.oracle.opensim_measures FILE...`` prints the differences.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import opensim

import osimlite
from osimlite.errors import OsimliteError
from osimlite.lint.measures import Measures, MeasuringPose
from osimlite.lint.measuring import measure_model
from osimlite.lint.measuring.jumps import SIDE_OFFSET
from osimlite.lint.measuring.muscles import REST_ACTIVATION
from osimlite.lint.measuring.sweeps import find_tied_coordinates
from tests.oracle.opensim_runs import put

BEYOND = 0.05
"""Distance outside of a coordinate range at which a moving path point is evaluated (rad or m)."""


class Beside:
    """One model loaded in osimlite and in OpenSim, for comparisons at the same pose."""

    def __init__(self, file: Path) -> None:
        opensim.Logger.setLevelString("off")
        self.model = osimlite.read(file)
        self.measures: Measures = measure_model(self.model, compiles=True)
        self.theirs = opensim.Model(str(file))
        self.state = self.theirs.initSystem()
        self.paths, self.right = osimlite.paths(self.model), osimlite.paths(self.model, "geodesic")
        self.default = self.paths.mechanism.assemble({})
        infos = self.paths.mechanism.coordinates
        self.coordinates = [
            opensim.Coordinate.safeDownCast(self.theirs.getComponent(info.path)) for info in infos
        ]

    def at(self, pose: MeasuringPose, aside: float = 0.0) -> np.ndarray:
        """Move both models to a pose and return the coordinate values (n,).

        Args:
            pose: pose of a measurement.
            aside: distance from the pose that is added to its coordinates (rad or m).
        """
        q = self.default.copy()
        places = [self.paths.mechanism.coordinate_index(value.coordinate) for value in pose.values]
        q[places] = [value.value + aside for value in pose.values]
        q = self.paths.mechanism.assemble(q, kept=places)
        put(self.coordinates, self.state, q, np.zeros(len(q)))
        self.theirs.realizeVelocity(self.state)
        return q

    def length(self, owner: str) -> float:
        """Return OpenSim's length (m) of the path of `owner` at the current pose."""
        tree = self.model.tree()
        path = self.theirs.getComponent(tree.path_of(tree.by_path[owner].geometry_path))
        return float(opensim.AbstractGeometryPath.safeDownCast(path).getLength(self.state))

    def findings(self) -> Iterator[tuple[str, str, float, float]]:
        """Yield code, component, reported value and OpenSim's value of each measurement."""
        yield from self._of_paths()
        yield from self._of_points()
        yield from self._of_muscles()

    def _of_paths(self) -> Iterator[tuple[str, str, float, float]]:
        for wrapping in filter(self.is_free, self.measures.wrappings):
            q = self.at(wrapping.pose)
            yield (
                "OSIM631",
                wrapping.owner,
                wrapping.worst,
                self.length(wrapping.owner) - self.right.lengths(q)[wrapping.owner],
            )
        for jump in filter(self.is_free, self.measures.jumps):
            lengths = []
            for aside in (-SIDE_OFFSET, SIDE_OFFSET):
                self.at(jump.pose, aside)
                lengths.append(self.length(jump.owner))
            yield "OSIM632", jump.owner, jump.size, abs(lengths[1] - lengths[0])
        for item in filter(self.is_free, self.measures.on_surfaces):
            q = self.at(item.pose)
            yield "OSIM633", item.owner, self.paths.lengths(q)[item.owner], self.length(item.owner)

    def is_free(self, item: Any) -> bool:
        """Return whether the constraints of the model move no coordinate of the pose.

        Otherwise it depends on OpenSim's assembly how the pose is reached, and values are not
        comparable.
        """
        places = [
            self.paths.mechanism.coordinate_index(value.coordinate) for value in item.pose.values
        ]
        return not find_tied_coordinates(self.paths, self.default)[places].any()

    def _of_points(self) -> Iterator[tuple[str, str, float, float]]:
        tree = self.model.tree()
        for point in self.measures.moving_points:
            points = tree.by_path[point.owner].geometry_path.path_point_set.objects
            (own,) = (item for item in points if item.name == point.point)
            theirs = opensim.MovingPathPoint.safeDownCast(
                self.theirs.getComponent(tree.path_of(own))
            )
            pose, places = MeasuringPose((point.end,)), []
            mechanism = self.paths.mechanism
            info = mechanism.coordinates[mechanism.coordinate_index(point.end.coordinate)]
            inward = 1.0 if point.end.value == info.range[0] else -1.0
            for aside in (0.0, inward * point.beyond, -inward * BEYOND):
                self.at(pose, aside)
                places.append(theirs.getLocation(self.state).to_numpy())
            self.at(pose)
            rate = np.linalg.norm(theirs.getdPointdQ(self.state).to_numpy())
            yield (
                "OSIM634",
                point.owner,
                point.displacement,
                float(np.linalg.norm(places[0] - places[1])),
            )
            yield "OSIM634", point.owner, point.rate, float(rate)
            yield "OSIM634", point.owner, 0.0, float(np.linalg.norm(places[2] - places[0]))

    def _of_muscles(self) -> Iterator[tuple[str, str, float, float]]:
        for start in self.measures.starts:
            self.state = self.theirs.initSystem()
            self.at(MeasuringPose())
            muscle = self._muscle(start.owner)
            for length, tension in zip(start.lengths, start.tensions, strict=True):
                if length == length:
                    yield "OSIM635", start.owner, length, self._fibers(muscle)
                    result = muscle.getActuation(self.state) / muscle.getMaxIsometricForce()
                    yield "OSIM635", start.owner, tension, result
                try:
                    muscle.computeEquilibrium(self.state)
                except RuntimeError:
                    break
        for reach in self.measures.reaches:
            self.state = self.theirs.initSystem()
            muscle = self._muscle(reach.owner)
            self.at(reach.pose)
            if not muscle.get_ignore_activation_dynamics():
                muscle.setActivation(self.state, 1.0 if reach.is_active else REST_ACTIVATION)
            try:
                muscle.computeEquilibrium(self.state)
            except RuntimeError:
                continue
            yield "OSIM636", reach.owner, reach.length, self._fibers(muscle)

    def _muscle(self, path: str) -> Any:
        return opensim.Muscle.safeDownCast(self.theirs.getComponent(path))

    def _fibers(self, muscle: Any) -> float:
        self.theirs.realizeDynamics(self.state)
        return float(muscle.getFiberLength(self.state) / muscle.getOptimalFiberLength())


def main(files: list[str]) -> None:
    """Print how many values of each rule were compared, and the largest differences."""
    counts: Counter[str] = Counter()
    worst: dict[str, list[tuple[float, str]]] = {}
    for file in files:
        try:
            for code, owner, told, result in Beside(Path(file)).findings():
                counts[code] += 1
                off = abs(told - result) / max(1.0, abs(told))
                worst.setdefault(code, []).append(
                    (off, f"{Path(file).name} {owner}: {told:.9g} {result:.9g}")
                )
        except (OsimliteError, RuntimeError) as error:
            print(file, str(error)[:100])
    for code, rows in sorted(worst.items()):
        print(code, counts[code], "compared, within 1e-6:", sum(off < 1e-6 for off, _ in rows))
        for off, words in sorted(rows, reverse=True)[:6]:
            print(f"    {off:.2g} {words}")


if __name__ == "__main__":
    main(sys.argv[1:])
