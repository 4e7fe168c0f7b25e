"""View of a model: its scene, motion and findings, for the page, pictures, files and the server."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from osimlite.base.files import write_atomically
from osimlite.base.records import dataclass, replace
from osimlite.errors import OsimliteError
from osimlite.io.meshes.folders import MeshFolders
from osimlite.lint import Config, Finding, validate
from osimlite.lint.many import check_files
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.elements.builder import OPENSIM
from osimlite.view.collect import build_scene
from osimlite.view.drawn_forces import LONGEST_ARROW, DrawnForces
from osimlite.view.glb import write_glb
from osimlite.view.incomplete import build_showable, describe_left_out
from osimlite.view.motion import (
    DrawableMotion,
    activity_color,
    get_values,
    interpolate_columns,
    read_activations,
)
from osimlite.view.page import Story, page_data, page_text
from osimlite.view.picture import Camera, ForceArrow, Style, draw_scene
from osimlite.view.recording import Recording, read_recording
from osimlite.view.rrd import write_rrd
from osimlite.view.scene import Color, Scene
from osimlite.view.server import PageServer

CAMERA_DIRECTION = (1.0, 0.35, 1.3)
"""Direction from the model to the camera of a picture: forward, up, and to the model's right."""


@dataclass(frozen=True, eq=False)
class ModelView:
    """Model with its scene, motion and findings, ready to be drawn.

    Attributes:
        model: model without the parts that cannot be built.
        scene: drawable objects of the model.
        q: coordinate values (n,) of the initial pose, rad or m.
        motion: motion of the model, or None for a model in a fixed pose.
        remarks: sentences about parts that cannot be drawn.
        checked: input of the validator: the model file, or the model with all its parts; None for
            `model`.
        mesh_folders: absolute paths of the folders with mesh files, for the validator.
    """

    model: Model
    scene: Scene
    q: Array
    motion: DrawableMotion | None = None
    remarks: tuple[str, ...] = ()
    checked: Model | Path | None = None
    mesh_folders: tuple[str, ...] = ()

    @cached_property
    def findings(self) -> Sequence[Finding]:
        """The findings of ``osimlite validate``, with the settings of the project.

        The model is checked at the first access, because pictures do not need findings.
        """
        config = Config(mesh_paths=self.mesh_folders)
        if isinstance(self.checked, Path):
            return check_files([str(self.checked)], config).findings
        return validate(
            self.model if self.checked is None else self.checked, config=config
        ).findings

    @classmethod
    def from_model(
        cls,
        model: Model,
        mechanism: Mechanism | None = None,
        folders: Sequence[str | Path] = (),
        *,
        file: Path | None = None,
        motion: DrawableMotion | Path | None = None,
        forces: Path | None = None,
        values: Mapping[str, float] | None = None,
        wrapping: str = OPENSIM,
        left_out: Sequence[tuple[str, str]] = (),
    ) -> ModelView:
        """Build the scene of a model and read its motion.

        Parts that cannot be built are left out of the scene; `remarks` and the findings name them.

        Args:
            model: model to draw.
            mechanism: multibody system of the same model; built if None.
            folders: folders with mesh files, searched besides the folder of `file`.
            file: file that the model was read from, which gives findings their lines; None: the
                model itself is checked.
            motion: motion, or a file (.sto, .mot) with one; None for a fixed pose.
            forces: file with contact forces, for a motion from a file.
            values: coordinate values by name (rad, m); they replace those of a motion from a file.
            wrapping: method that bends paths around surfaces, see
                :class:`osimlite.simulation.Options`.
            left_out: paths of the parts that the caller has removed from `model` because they
                cannot be built, with the reasons.

        Returns:
            View of the model, with its motion and remarks.

        Raises:
            OsimliteError: a file is missing or has the wrong contents; no pose satisfies the
                constraints.
            SettingError: the wrapping method is unknown.
        """
        # Findings are about the complete model, also about parts that are not drawn.
        checked: Model | Path = model if file is None else file
        if mechanism is None:
            model, mechanism, left_out = build_showable(model)
        mesh_folders = MeshFolders(None if file is None else file.parent, folders)
        scene = build_scene(model, mechanism, mesh_folders, wrapping)
        searched = tuple(str(folder.resolve()) for folder in mesh_folders.searched)
        # Parts that could not be built come before parts that could not be drawn.
        if left_out:
            scene = replace(scene, remarks=[*left_out, *scene.remarks])
        remarks = [*describe_left_out(scene.remarks)]
        if isinstance(motion, Path):
            folder = None if file is None else file.parent
            motion = read_recording(model, mechanism, motion, forces, values, folder=folder)
        if isinstance(motion, Recording):
            remarks += motion.remarks
        q = mechanism.assemble(values or {})
        return cls(model, scene, q, motion, tuple(remarks), checked, searched)

    def page_text(self, story: Story | None = None) -> str:
        """Return one self-contained HTML page with the viewer."""
        return page_text(
            page_data(self.model, self.scene, self.motion, self.findings, self.q, story=story)
        )

    def write_page(self, path: str | Path, story: Story | None = None) -> Path:
        """Write one self-contained HTML page with the viewer.

        Args:
            path: file to write.
            story: title, text and settings of the page, which may play the motion at once.

        Returns:
            Path of the written file.
        """
        write_atomically(path, self.page_text(story))
        return Path(path)

    def write_glb(self, path: str | Path) -> Path:
        """Write a glTF 2.0 file (.glb) with the model and its motion.

        Returns:
            Path of the file.
        """
        return write_glb(self.scene, self.q, self.motion, path)

    def write_rrd(self, path: str | Path) -> Path:
        """Write a recording for Rerun (.rrd) with the model and its motion.

        Returns:
            Path of the file.

        Raises:
            MissingDependency: rerun-sdk is not installed.
        """
        return write_rrd(self.scene, self.q, self.motion, path)

    def create_server(self, port: int = 0) -> PageServer:
        """Return a server of the page at a port of this machine; 0 selects a free port."""
        data = page_data(self.model, self.scene, self.motion, self.findings, self.q, server=True)
        return PageServer(page_text(data), self.scene.mechanism, port)

    def write_picture(
        self, path: str | Path, size: tuple[int, int] = (1200, 900), time: float | None = None
    ) -> Path:
        """Write a picture as PNG, or in another format that Pillow derives from the suffix.

        Args:
            path: file to write.
            size: width and height in pixels.
            time: time of the motion, s; the first time if None.

        Returns:
            Path of the written file.

        Raises:
            OsimliteError: the time is outside of the motion, or the format is unknown.
            MissingDependency: pillow is not installed.
        """
        scene, up = self.scene, self.scene.up
        q, arrows, loaded, colors = self._describe_moment(time)
        bodies = scene.compute_poses(q)
        visible_points = [
            *(p for _, p in scene.iterate_extents(bodies) if len(p)),
            *(arrow.point[None] for arrow in arrows),
        ]
        # A model without bodies still has ground to draw.
        points = np.concatenate(visible_points or [np.array(scene.compute_box(q))])
        # A horizontal direction: perpendicular to X, or to Y where X is the vertical.
        side = np.cross((1.0, 0.0, 0.0), up) if abs(up[0]) < 0.9 else np.cross((0.0, 1.0, 0.0), up)
        direction = (
            CAMERA_DIRECTION[0] * np.cross(up, side)
            + CAMERA_DIRECTION[1] * up
            + CAMERA_DIRECTION[2] * side
        )
        camera = Camera.from_points(points, up, direction, size[0] / size[1])
        picture = draw_scene(
            scene, q, camera, size, arrows, Style(scene.find_floor_height(q), loaded, colors)
        )
        buffer = io.BytesIO()
        try:
            picture.save(buffer, Path(path).suffix[1:].upper() or "PNG")
        except (KeyError, ValueError, OSError):
            raise OsimliteError("pictures are written as .png", file=str(path)) from None
        write_atomically(path, buffer.getvalue())
        return Path(path)

    def _describe_moment(
        self, time: float | None
    ) -> tuple[Array, list[ForceArrow], frozenset[str], dict[str, Color]]:
        """Return what a picture shows at a time of the motion.

        Returns:
            Coordinate values (n,), force arrows, paths of the surfaces under load, and colours of
            muscles by path.

        Raises:
            OsimliteError: a time is given without a motion, or lies outside of the motion.
        """
        motion = self.motion
        if motion is None:
            if time is not None:
                raise OsimliteError(
                    "a time was given without a motion; name the file of a motion after the model"
                )
            return self.q, [], frozenset(), {}
        first, last = float(motion.times[0]), float(motion.times[-1])
        if time is not None and not first <= time <= last:
            raise OsimliteError(
                f"the motion goes from {first:g} to {last:g} s, and does not contain the time {time:g} s"
            )
        moment = np.array([first if time is None else time])
        values = get_values(motion, self.scene.mechanism)
        q = interpolate_columns(motion, values, moment)[0]
        # Arrows are scaled by the largest force of the complete motion, so that pictures compare.
        largest_force = DrawnForces.from_motion(
            self.scene, motion, np.asarray(motion.times, dtype=float)
        ).largest
        lowest, highest = self.scene.compute_box(q)
        scale = (
            LONGEST_ARROW * float(np.linalg.norm(highest - lowest)) / largest_force
            if largest_force > 0.0
            else 0.0
        )
        drawn_forces = DrawnForces.from_motion(self.scene, motion, moment).locate_forces(
            0, self.scene.compute_poses(q)
        )
        loaded = frozenset(
            drawn_force.surface for drawn_force, _, force in drawn_forces if force.any()
        )
        levels = read_activations(self.scene, motion).items()
        colors = {
            path: activity_color(float(np.interp(moment[0], motion.times, level)))
            for path, level in levels
        }
        return (
            q,
            [ForceArrow(point, scale * force) for _, point, force in drawn_forces],
            loaded,
            colors,
        )
