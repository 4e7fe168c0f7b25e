"""Lengths and moment arms of candidate paths of a converted model, in sampled poses."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from osimlite.errors import ModelError
from osimlite.io.document.printer import to_text
from osimlite.io.document.reader import read_text
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.muscles import PathActuator
from osimlite.schema.paths import AbstractGeometryPath
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.paths import Paths
from osimlite.translate.mjcf_import.coordinate_map import CoordinateMap
from osimlite.translate.mjcf_import.draft import ConversionDraft


class Bench:
    """A copy of the mechanism under construction that carries candidate paths.

    Args:
        draft: OpenSim model under construction, with complete bodies and joints.
    """

    def __init__(self, draft: ConversionDraft) -> None:
        self._draft = draft
        self.coordinates = CoordinateMap.build(draft.mj, draft.coordinates, draft.rotors)
        self.model = read_text(to_text(draft.model))
        self.frames: list[PhysicalFrame] = []
        for frame in draft.frames:
            path = draft.model.tree().path_of(frame)
            frame_copy = self.model.find(path or "/ground")
            assert isinstance(frame_copy, PhysicalFrame)
            self.frames.append(frame_copy)
        self._count = 0

    def add(self, path: AbstractGeometryPath) -> int:
        """Add a candidate.

        Returns:
            Index of the candidate, from 0.
        """
        self.model.add(PathActuator(name=f"candidate_{self._count}", geometry_path=path))
        self._count += 1
        return self._count - 1

    def find_unsolvable(self) -> set[int]:
        """Return the numbers of the candidates that cannot be computed in the default pose."""
        builder = ElementBuilder(self.model, build_mechanism(self.model), Path())
        result = set()
        for number in range(self._count):
            try:
                PATH.read(builder, self.model.find(f"/forceset/candidate_{number}"))
            except ModelError:
                result.add(number)
        return result

    def measure(self, qpos: Array, *, arms: bool = False) -> tuple[Array, Array, list[str]]:
        """Measure all candidates.

        Args:
            qpos: MuJoCo's positions (P, nq).
            arms: whether to compute moment arms.

        Returns:
            Lengths (k, P), moment arms (k, P, n) or an empty array, and the names of the n
            coordinates.
        """
        paths = Paths(self.model)
        names = list(paths.mechanism.coordinate_names)
        values = np.array([self._row(names, pose) for pose in qpos])
        candidate_rows = [paths.names.index(f"/forceset/candidate_{k}") for k in range(self._count)]
        lengths = paths.system.measure_poses(values).T[candidate_rows]
        if not arms:
            return lengths, np.empty(0), names
        moment_arms = np.nan_to_num(paths.compute_moment_arms(values)).swapaxes(0, 1)[
            candidate_rows
        ]
        return lengths, moment_arms, names

    def _row(self, names: Sequence[str], qpos: Array) -> list[float]:
        values = self.coordinates.values(qpos)
        return [values[name] for name in names]
