"""Motions for animation programs: a model and its motion as a BVH file, and BVH files as markers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from osimlite.base.files import make_folder, open_atomically
from osimlite.base.records import dataclass
from osimlite.base.text import format_count
from osimlite.errors import SettingError
from osimlite.io.bvh import BvhMotion, format_bvh, read_bvh
from osimlite.io.tables.writers import write_trc
from osimlite.mechanics.multibody import build_mechanism
from osimlite.schema.frames import Body
from osimlite.schema.model import Model
from osimlite.simulation.bvh_export import CENTIMETRES, make_bvh
from osimlite.simulation.recorded_motion import RecordedMotion
from osimlite.simulation.robot.names import UniqueNames
from osimlite.translate.fidelity import LEFT_OUT, Fidelity

CONTENTS = ("muscles, forces and shapes", LEFT_OUT)
"""Components that a BVH skeleton cannot hold, and their treatment."""


@dataclass(frozen=True)
class Bvh:
    """A model and its motion as BVH.

    Attributes:
        name: name of the file without suffix.
        motion: skeleton and motion.
        fidelity: record of what was translated, approximated or left out.
    """

    name: str
    motion: BvhMotion
    fidelity: Fidelity

    def write(self, folder: str | Path) -> list[Path]:
        """Write ``<name>.bvh`` into a folder, which is made if it does not exist.

        Returns:
            Path of the written file, in a list.
        """
        path = make_folder(folder) / f"{self.name}.bvh"
        with open_atomically(path) as stream:
            for chunk in format_bvh(self.motion):
                stream.write(chunk.encode())
        return [path]


def to_bvh(
    model: Model,
    *,
    motion: str | Path | None = None,
    scale: float = CENTIMETRES,
    name: str | None = None,
    folder: str | Path | None = None,
    geometry: Sequence[str | Path] = (),
) -> Bvh:
    """Return a model and its motion as BVH.

    Args:
        model: model to translate.
        motion: file of the coordinates over time (.sto, .mot); None for one frame, the default
            pose.
        scale: numbers of the file per metre.
        name: name of the file without suffix; that of the model by default.
        folder: folder of the model file, as for other exporters; not used here.
        geometry: folders with mesh files, as for other exporters; not used here.

    Raises:
        SettingError: the scale is not positive.
        ModelError: the model is not a mechanism.
    """
    if not 0.0 < scale < np.inf:
        raise SettingError(f"the scale must be a positive number, not {scale:g}")
    mechanism = build_mechanism(model)
    # Without a motion the file has one frame, the default pose.
    times = np.zeros(1)
    values = np.asarray(mechanism.assemble({}), dtype=float)[None, :]
    if motion is not None:
        # Poses that violate constraints would tear the skeleton.
        assembled = RecordedMotion.read(mechanism, motion).assemble_poses()
        times, values = np.asarray(assembled.times), np.asarray(assembled.values)
    result = make_bvh(mechanism, times, values, scale=scale)
    fidelity = Fidelity(mechanism.name, "bvh")
    for body, joint in zip(mechanism.bodies, result.names, strict=True):
        fidelity.translated[body.path] = f"joint {joint}"
        if joint in result.translating:
            fidelity.add(
                "translation",
                body.path,
                "a bone whose joint moves relative to its parent bone; some programs ignore this",
                "position channels: poses are exact in programs that read these channels",
            )
    translated_paths = fidelity.translated.keys()
    # Bodies that are welded to others have no joint.
    for component in model.body_set.objects:
        if isinstance(component, Body) and component.path not in translated_paths:
            fidelity.add("body", component.path, "a body that is part of another one", LEFT_OUT)
    if any(True for _ in model.force_set.objects):
        fidelity.add("force", "/forceset", *CONTENTS)
    if result.is_resampled:
        fidelity.add(
            "times",
            "/",
            "frames at unequal times",
            "coordinates interpolated linearly to equal time steps",
            f"{format_count(len(values), 'row')} became {format_count(len(result.motion.values), 'frame')}",
        )
    return Bvh(name or mechanism.name or "model", result.motion, fidelity)


class BvhMarkers:
    """Joint centres of a BVH file as markers, for `ik` and `fit`.

    Args:
        path: path of the BVH file.
        name: name of the written file without suffix; that of the file by default.
        scale: numbers of the file per metre.

    Raises:
        DocumentError: the file is not a BVH file, or is damaged.
    """

    def __init__(
        self, path: str | Path, name: str | None = None, scale: float = CENTIMETRES
    ) -> None:
        if not 0.0 < scale < np.inf:
            raise SettingError(f"the scale must be a positive number, not {scale:g}")
        self.motion = read_bvh(path)
        self.name = name or Path(path).stem
        self._scale = scale
        self.fidelity = Fidelity(self.name, "trc")
        names = UniqueNames()
        self.markers = [names(joint.name) for joint in self.motion.joints]
        self.positions = self.motion.compute_poses()[1] / scale
        for joint, marker in zip(self.motion.joints, self.markers, strict=True):
            self.fidelity.translated[f"/{marker}"] = f"marker {marker}"
            if joint.name != marker:
                self.fidelity.add(
                    "name",
                    f"/{marker}",
                    "a name with spaces or special characters, or a name that several joints have",
                    "written with '_' or with a number at its end",
                    f"'{joint.name}' became '{marker}'",
                )
        self.fidelity.add(
            "rotation",
            "/",
            "rotations of bones about their own axes",
            f"{LEFT_OUT}: positions of joint centres do not contain them",
        )

    @property
    def summary(self) -> dict[str, object]:
        """Numbers of joints and frames, frame time (s) and scale, for ``summary.json``.

        Returns:
            Plain data by name.
        """
        return {
            "joints": len(self.markers),
            "frames": len(self.motion.values),
            "frame_time_s": self.motion.frame_time,
            "numbers_per_metre": self._scale,
        }

    def write(self, folder: str | Path) -> list[Path]:
        """Write the markers into a folder, which is made if it does not exist.

        Returns:
            Path of the written file, in a list.
        """
        path = make_folder(folder) / f"{self.name}.trc"
        rows = self.positions.reshape(len(self.positions), -1)
        write_trc(path, self.motion.times.tolist(), self.markers, rows)
        return [path]
