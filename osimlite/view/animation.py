"""An animated picture (GIF) of a motion, seen from the side."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from osimlite.base.files import write_atomically
from osimlite.base.require import require
from osimlite.errors import OsimliteError
from osimlite.io.meshes.folders import MeshFolders
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.elements.builder import OPENSIM
from osimlite.view.collect import build_scene
from osimlite.view.drawn_forces import DrawnForces
from osimlite.view.motion import (
    DrawableMotion,
    activity_color,
    find_moving_bodies,
    get_values,
    interpolate_columns,
    read_activations,
)
from osimlite.view.picture import FORCE, INK, SKY, Camera, ForceArrow, Style, draw_scene
from osimlite.view.scene import MIN_FLOOR_COSINE, Scene

Plane = Literal["xy", "yz", "xz"]

_AXES: Mapping[str, tuple[Array, Array]] = {
    "xy": (np.array((1.0, 0.0, 0.0)), np.array((0.0, 1.0, 0.0))),
    "yz": (np.array((0.0, 0.0, -1.0)), np.array((0.0, 1.0, 0.0))),
    "xz": (np.array((1.0, 0.0, 0.0)), np.array((0.0, 0.0, -1.0))),
}
"""Unit vectors to the right and up in the picture of each plane. The view is against their cross
product: along -Z, -X (so that Z points to the left) and -Y (so that Z points down).
"""

LONGEST_ARROW = 0.7
"""Length of the arrow of the largest force, as a part of half the picture's height."""

SCENERY_SIZE = 3.0
"""Size of a static object, relative to the moving objects, above which pictures may cut it off."""

Progress = Callable[[int, int], None]


def animate(
    model: Model,
    trajectory: DrawableMotion,
    path: str | Path,
    *,
    fps: int = 25,
    speed: float = 1.0,
    plane: Plane = "xy",
    size: tuple[int, int] = (640, 480),
    folders: Sequence[Path] = (),
    file: Path | None = None,
    wrapping: str = OPENSIM,
    progress: Progress | None = None,
) -> Path:
    """Draw a motion as an animated GIF.

    The film shows the bodies' geometry (a stick figure for bodies without), contact surfaces, paths
    and markers, half spaces as ground, and the contact forces as arrows; the camera follows the
    moving bodies.

    Args:
        model: model that moves.
        trajectory: motion of the model.
        path: file to write.
        fps: frames per second of the film; a GIF shows at most 50.
        speed: seconds of motion per second of film, 1 for real time.
        plane: plane of the picture: ``"xy"`` looks along -Z, ``"yz"`` along -X, ``"xz"`` along -Y.
        size: width and height in pixels.
        folders: further folders with mesh files, besides the folder of `file`.
        file: model file, in whose folder mesh files are searched; None to search only `folders`.
        wrapping: method of wrapping paths around surfaces, see
            :class:`osimlite.simulation.Options`.
        progress: called with the number of frames done and of all frames.

    Returns:
        Path of the file.

    Raises:
        MissingDependency: pillow is not installed.
        OsimliteError: the motion has no moments, or an argument is out of range.
        SettingError: there is no such wrapping.
    """
    if not 1 <= fps <= 50:
        raise OsimliteError(f"a GIF can show 1 to 50 frames per second, not {fps}")
    if not speed > 0.0:
        raise OsimliteError(f"the speed of an animation must be a positive number, not {speed}")
    if len(trajectory.times) == 0:
        raise OsimliteError("the motion has no rows; nothing can be drawn")
    image = require("PIL.Image", extra="view", purpose="an animation")
    scene = build_scene(
        model,
        build_mechanism(model),
        MeshFolders(None if file is None else file.parent, folders),
        wrapping,
    )
    film = Film(scene, trajectory, fps, speed, plane)
    painter = _Painter(film, size)
    frames = []
    for number in range(len(film.times)):
        frames.append(painter.draw_frame(number))
        if progress is not None:
            progress(number + 1, len(film.times))
    target = Path(path)
    write_atomically(target, _encode_frames(frames, fps, image))
    return target


def _encode_frames(frames: list[Any], fps: int, image: Any) -> bytes:
    """Return the frames as a GIF, all with one palette, so that colours do not flicker."""
    # Colours of the first frame alone may lack those of active muscles.
    # A sheet of some of the frames, side by side, has all the colours.
    sampled_frames = frames[:: max(1, len(frames) // 6)]
    width, height = frames[0].size
    sheet = image.new("RGB", (width * len(sampled_frames), height))
    for index, frame in enumerate(sampled_frames):
        sheet.paste(frame, (index * width, 0))
    palette = sheet.quantize(128, dither=image.Dither.NONE)
    first, *other_frames = (
        frame.quantize(palette=palette, dither=image.Dither.NONE) for frame in frames
    )
    buffer = io.BytesIO()
    # A GIF counts time in hundredths of a second.
    duration = max(2, round(100 / fps)) * 10
    first.save(
        buffer,
        "GIF",
        save_all=True,
        append_images=other_frames,
        duration=duration,
        loop=0,
        optimize=False,
    )
    return buffer.getvalue()


class Film:
    """Motion at the times of the frames, with the region of space that it covers."""

    def __init__(
        self, scene: Scene, motion: DrawableMotion, fps: int, speed: float, plane: Plane
    ) -> None:
        if plane not in _AXES:
            raise OsimliteError(f"a picture shows the plane 'xy', 'yz' or 'xz', not '{plane}'")
        self.right, self.up = _AXES[plane]
        self.scene, self.mechanism = scene, scene.mechanism
        recorded = np.asarray(motion.times, dtype=float)
        # 1e-9: the last frame counts if it differs by rounding only.
        count = int(np.floor((recorded[-1] - recorded[0]) * fps / speed + 1e-9)) + 1
        self.times = recorded[0] + np.arange(count) * speed / fps
        values = get_values(motion, self.mechanism)
        self.q = interpolate_columns(motion, values, self.times)
        self.poses = self.scene.compute_all_poses(self.q)
        self.moving = find_moving_bodies(self.poses)
        self.drawn_forces = DrawnForces.from_motion(self.scene, motion, self.times)
        self.activity = {
            path: np.interp(self.times, recorded, levels)
            for path, levels in read_activations(self.scene, motion).items()
        }
        self.focus = self._compute_focus()
        self.reach = self._compute_reach()

    def project_points(self, points: Array) -> Array:
        """Return the projections (k, 2) of points (k, 3) in ground onto the picture plane, m."""
        return np.column_stack((points @ self.right, points @ self.up))

    def _compute_focus(self) -> Array:
        """Return the points (m, 3) that the camera follows: the mass centre of the moving bodies.

        Without a moving mass it is the mean of the body origins in the first pose.
        """
        masses = np.array([body.mass_properties.mass for body in self.mechanism.bodies])
        # Bodies that stand still would hold the camera back.
        masses = np.where(self.moving[:-1], masses, 0.0)
        if not masses.any():
            return np.tile(self.poses[0].origins.mean(axis=0), (len(self.poses), 1))
        centers = np.array([body.mass_properties.center for body in self.mechanism.bodies])
        path = [
            masses
            @ (np.einsum("bij,bj->bi", pose.rotations[:-1], centers) + pose.origins[:-1])
            / masses.sum()
            for pose in self.poses
        ]
        return np.array(path)

    def _compute_reach(self) -> Array:
        """Return the largest distances (2,) from the focus in the picture, sideways and vertical, m.

        Static objects count only if they are not much larger than the moving ones: a walker's
        floor would make the walker tiny.
        """
        moving_reach = static = np.full(2, 0.05)
        for number, focus in enumerate(self.project_points(self.focus)):
            for is_moving, points in self._iterate_corners(number):
                distances = np.abs(points - focus).max(axis=0)
                if is_moving:
                    moving_reach = np.maximum(moving_reach, distances)
                # Static objects are measured apart.
                else:
                    static = np.maximum(static, distances)
        return (
            np.maximum(moving_reach, static)
            if (static <= SCENERY_SIZE * moving_reach.max()).all()
            else moving_reach
        )

    def _iterate_corners(self, number: int) -> Iterator[tuple[bool, Array]]:
        """Yield for each drawn object whether it moves and its points (k, 2) in the picture.

        A half space yields only its point below the focus, because it has no extent of its own.
        """
        pose, focus = self.poses[number], self.focus[number]
        for body, points in self.scene.iterate_extents(pose):
            if len(points):
                yield body < -1 or bool(self.moving[body]), self.project_points(points)
        for drawn_item in self.scene.iterate_visible_items():
            if drawn_item.path in self.scene.half_spaces:
                transform = pose.transform_frame(drawn_item.body, drawn_item.matrix)
                # The direction into a half space is its X axis.
                inward = transform[:3, 0]
                # A steep plane crosses the line below the focus far away.
                if abs(inward @ self.up) > MIN_FLOOR_COSINE * np.linalg.norm(inward):
                    point_below = focus + self.up * ((transform[:3, 3] - focus) @ inward) / (
                        inward @ self.up
                    )
                    yield False, self.project_points(point_below[None])


class _Painter:
    """Painter of single frames."""

    def __init__(self, film: Film, size: tuple[int, int]) -> None:
        self.film, self.size = film, size
        self.pen = require("PIL.ImageDraw", extra="view", purpose="an animation")
        fonts = require("PIL.ImageFont", extra="view", purpose="an animation")
        self.font, self.small = (fonts.load_default(size[1] / divisor) for divisor in (26.0, 32.0))
        # Half the width and half the height of the picture in metres, with a margin of 12 % around
        # what moves.
        half_width, half_height = (1.12 * film.reach).tolist()
        aspect = size[0] / size[1]
        self.half = max(half_width, half_height * aspect), max(half_height, half_width / aspect)
        largest_force = film.drawn_forces.largest
        self.meters_per_newton = (
            LONGEST_ARROW * self.half[1] / largest_force if largest_force > 0.0 else 0.0
        )

    def draw_frame(self, number: int) -> Any:
        """Return a drawing of frame `number` as a pillow image."""
        film = self.film
        pose = self.film.poses[number]
        camera = Camera(film.right, film.up, film.focus[number], self.half)
        drawn_forces = film.drawn_forces.locate_forces(number, pose)
        arrows = [
            ForceArrow(point, force * self.meters_per_newton) for _, point, force in drawn_forces
        ]
        loaded = frozenset(
            drawn_force.surface for drawn_force, _, force in drawn_forces if force.any()
        )
        colors = {
            path: activity_color(float(levels[number])) for path, levels in film.activity.items()
        }
        frame = draw_scene(
            film.scene, film.q[number], camera, self.size, arrows, Style(None, loaded, colors)
        )
        self._draw_labels(self.pen.Draw(frame), number)
        return frame

    def _draw_labels(self, pen: Any, number: int) -> None:
        width, height = self.size
        ink, force, sky = (to_hex(color) for color in (INK, FORCE, SKY))
        style = {"font": self.font, "fill": ink, "stroke_width": 3, "stroke_fill": sky}
        pen.text((0.03 * width, 0.03 * height), f"t = {self.film.times[number]:.2f} s", **style)
        pen.text((0.97 * width, 0.03 * height), self.film.mechanism.name, anchor="ra", **style)
        # Pixels per metre.
        pixels = 0.5 * width / self.half[0]
        length = round_down(0.4 * self.half[0])
        self._draw_scale_bar(pen, 0.03 * width, length * pixels, f"{length:g} m", ink)
        if self.meters_per_newton > 0.0:
            newtons = round_down(0.4 * self.half[0] / self.meters_per_newton)
            bar_length = newtons * self.meters_per_newton * pixels
            self._draw_scale_bar(
                pen, 0.97 * width - bar_length, bar_length, f"{newtons:g} N", force
            )

    def _draw_scale_bar(self, pen: Any, x: float, length: float, text: str, color: str) -> None:
        y = 0.95 * self.size[1]
        pen.line((x, y, x + length, y), fill=color, width=max(3, round(self.size[1] / 120)))
        text_position = x + 0.5 * length, y - 0.015 * self.size[1]
        pen.text(
            text_position,
            text,
            anchor="mb",
            font=self.small,
            fill=color,
            stroke_width=3,
            stroke_fill=to_hex(SKY),
        )


def to_hex(color: tuple[float, ...]) -> str:
    """Return a colour as #rrggbb."""
    return "#" + "".join(f"{round(255 * channel):02x}" for channel in color)


def round_down(value: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is not above a positive value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(
        max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value * (1 + 1e-9))
    )
