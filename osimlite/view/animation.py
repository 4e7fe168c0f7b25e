"""An animated picture (GIF) of a motion, seen from the side."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from osimlite._require import require
from osimlite.errors import OsimliteError
from osimlite.files import write_atomically
from osimlite.multibody import build_mechanism
from osimlite.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.view.motion import Motion, at_times, contact_forces, in_mechanism_order
from osimlite.view.scene import Bodies, Disc, Outline, Plane, Push, Scene

SKY, INK, EARTH, FORCE, TOUCHING = "#f6f8fb", "#26323f", "#8a7a66", "#d55e00", "#f7dc9d"
"""Colours of background, lines, ground, force arrows and loaded contact spheres (Okabe and Ito's where they matter)."""

LONGEST_ARROW = 0.7
"""Length of the arrow of the largest force, as a part of half the picture's height."""

FAINTEST = 0.72
"""How bright a shape at the back is, compared with one at the front."""

SCENERY = 3.0
"""How many times larger than what moves something that stands still may be and still be shown whole."""

Progress = Callable[[int, int], None]


def animate(
    model: Model,
    trajectory: Motion,
    path: str | Path,
    *,
    fps: int = 25,
    speed: float = 1.0,
    plane: Plane = "xy",
    size: tuple[int, int] = (640, 480),
    progress: Progress | None = None,
) -> Path:
    """Draw a motion as an animated GIF.

    The picture shows the outlines of the bodies' geometry (a stick figure for bodies without), contact spheres, half
    spaces as ground, and the contact forces as arrows; the camera follows what moves.

    Args:
        model: what moves.
        trajectory: how it moves.
        path: the file to write.
        fps: frames per second of the film; a GIF shows at most 50.
        speed: seconds of motion per second of film.
        plane: the plane of the picture: ``"xy"`` looks along -Z, ``"yz"`` along -X, ``"xz"`` along -Y.
        size: width and height in pixels.
        progress: called with the number of frames done and of all frames.

    Raises:
        MissingDependency: matplotlib or pillow is not installed.
        OsimliteError: the motion has no moments, or an argument is out of range.
    """
    if not 1 <= fps <= 50:
        raise OsimliteError(f"a GIF shows 1 to 50 frames per second, not {fps}")
    if not speed > 0.0:
        raise OsimliteError(f"the speed of a film is a positive number, not {speed}")
    if len(trajectory.times) == 0:
        raise OsimliteError("the motion has no moments; nothing can be drawn")
    image = require("PIL.Image", extra="plot", purpose="an animation")
    film = _Film(model, trajectory, fps, speed, plane)
    painter = _Painter(film, size)
    frames = []
    for number in range(len(film.times)):
        frames.append(painter.picture(number, image))
        if progress is not None:
            progress(number + 1, len(film.times))
    target = Path(path)
    write_atomically(target, _encoded(frames, fps, image))
    return target


def _encoded(frames: list[Any], fps: int, image: Any) -> bytes:
    """The frames as a GIF, all with one palette, so that colours do not flicker."""
    # A sheet of some of the frames, side by side, has all the colours.
    some = frames[:: max(1, len(frames) // 6)]
    width, height = frames[0].size
    sheet = image.new("RGB", (width * len(some), height))
    for place, frame in enumerate(some):
        sheet.paste(frame, (place * width, 0))
    palette = sheet.quantize(128, dither=image.Dither.NONE)
    first, *others = (frame.quantize(palette=palette, dither=image.Dither.NONE) for frame in frames)
    out = io.BytesIO()
    # A GIF counts time in hundredths of a second.
    duration = max(2, round(100 / fps)) * 10
    first.save(out, "GIF", save_all=True, append_images=others, duration=duration, loop=0, optimize=False)
    return out.getvalue()


@dataclass(frozen=True, eq=False)
class _Arrow:
    """The force (m, 3) in ground of a push at the moments of the film, N."""

    push: Push
    vectors: Array


class _Film:
    """The motion at the moments of the film, and how much of space it takes."""

    def __init__(self, model: Model, motion: Motion, fps: int, speed: float, plane: Plane) -> None:
        self.mechanism = build_mechanism(model)
        self.scene = Scene(model, self.mechanism, plane)
        recorded = np.asarray(motion.times, dtype=float)
        count = int(np.floor((recorded[-1] - recorded[0]) * fps / speed + 1e-9)) + 1
        self.times = recorded[0] + np.arange(count) * speed / fps
        values = in_mechanism_order(motion, self.mechanism, np.asarray(motion.values, dtype=float))
        q = at_times(motion, values, self.times)
        self.poses = [self.scene.at(row) for row in q]
        self.silhouettes = [
            [self.scene.silhouette(pose, shape) for shape in self.scene.outlines] for pose in self.poses
        ]
        self.moving = _moving(self.poses)
        self.arrows = list(self._arrows(motion))
        self.largest = max((float(np.abs(arrow.vectors).max()) for arrow in self.arrows), default=0.0)
        self.focus = self._focus()
        self.reach = self._reach()

    def _arrows(self, motion: Motion) -> list[_Arrow]:
        forces = contact_forces(motion)
        found = []
        for push in self.scene.pushes:
            body = self.mechanism.bodies[push.sphere.body].name if push.sphere.body >= 0 else "ground"
            names = (push.sphere.frame, body, push.sphere.name)
            force = next((f for f in forces if f.element == push.element and f.frame in names), None)
            if force is not None:
                found.append(_Arrow(push, at_times(motion, force.vectors, self.times)))
        return found

    def _focus(self) -> Array:
        """What the camera looks at (m, 2): the mass centre of what moves, or the middle of everything."""
        masses = np.array([body.mass_properties.mass for body in self.mechanism.bodies])
        masses = np.where(self.moving[:-1], masses, 0.0)
        if not masses.any():
            return np.tile(self.scene.flat(self.poses[0].origins).mean(axis=0), (len(self.poses), 1))
        centers = np.array([body.mass_properties.center for body in self.mechanism.bodies])
        path = [
            masses @ (np.einsum("bij,bj->bi", pose.rotations[:-1], centers) + pose.origins[:-1]) / masses.sum()
            for pose in self.poses
        ]
        return self.scene.flat(np.array(path))

    def _reach(self) -> Array:
        """How far (2,) from the focus things get, to the side and up or down.

        Everything that moves counts, and of what stands still only what is not much larger: a walker's floor is not.
        """
        moving = still = np.full(2, 0.05)
        for number, focus in enumerate(self.focus):
            for body, corners in self._corners(number):
                away = np.abs(corners - focus).max(axis=0)
                if self.moving[body]:
                    moving = np.maximum(moving, away)
                else:
                    still = np.maximum(still, away)
        return np.maximum(moving, still) if (still <= SCENERY * moving.max()).all() else moving

    def _corners(self, number: int) -> Iterator[tuple[int, Array]]:
        """Body and points (k, 2) of everything that may be drawn."""
        pose = self.poses[number]
        for shape, corners in zip(self.scene.outlines, self.silhouettes[number], strict=True):
            yield shape.body, corners
        for disc in self.scene.discs.values():
            middle = self.scene.flat(pose.points(disc.body, disc.center[None, :]))
            yield disc.body, np.vstack((middle - disc.radius, middle + disc.radius))
        for body, lines in self.scene.sticks(pose):
            yield body, self.scene.flat(lines.reshape(-1, 3))


def _moving(poses: list[Bodies]) -> Array:
    """Which bodies (b + 1,) change place over the film; all of them if none does."""
    rotations, origins = np.array([p.rotations for p in poses]), np.array([p.origins for p in poses])
    change = np.ptp(rotations, axis=0).max(axis=(1, 2)) + np.ptp(origins, axis=0).max(axis=1)
    moving = change > 1e-9
    if not moving.any():
        moving[:-1] = True
    result: Array = moving
    return result


class _Painter:
    """Draws one frame after the other on the same canvas."""

    def __init__(self, film: _Film, size: tuple[int, int]) -> None:
        self.film, self.scene = film, film.scene
        figure = require("matplotlib.figure", extra="plot", purpose="an animation")
        backend = require("matplotlib.backends.backend_agg", extra="plot", purpose="an animation")
        self.patches = require("matplotlib.patches", extra="plot", purpose="an animation")
        self.figure = figure.Figure(figsize=(size[0] / 100, size[1] / 100), dpi=100, facecolor=SKY)
        self.canvas = backend.FigureCanvasAgg(self.figure)
        self.axes = self.figure.add_axes((0.0, 0.0, 1.0, 1.0))
        # Half the width and half the height of the picture, in metres, with a margin around what moves.
        wide, high = 1.12 * film.reach
        aspect = size[0] / size[1]
        self.half = np.array((max(wide, high * aspect), max(high, wide / aspect)))
        self.meters_per_newton = LONGEST_ARROW * self.half[1] / film.largest if film.largest > 0.0 else 0.0

    def picture(self, number: int, image: Any) -> Any:
        """Frame `number` as a pillow image."""
        film, axes, pose = self.film, self.axes, self.film.poses[number]
        axes.clear()
        axes.set_axis_off()
        center = film.focus[number]
        axes.set_xlim(center[0] - self.half[0], center[0] + self.half[0])
        axes.set_ylim(center[1] - self.half[1], center[1] + self.half[1])
        axes.set_aspect("equal")
        for placed in self.scene.planes.values():
            self._ground(
                pose.points(placed.body, placed.matrix[None, :3, 3])[0],
                pose.vector(placed.body, -placed.matrix[:3, 0]),
                center,
            )
        self._bodies(number)
        loads = {id(arrow.push.sphere): float(np.linalg.norm(arrow.vectors[number])) for arrow in film.arrows}
        for disc in self.scene.discs.values():
            self._disc(pose, disc, loads.get(id(disc), 0.0))
        for arrow in film.arrows:
            self._arrow(pose, arrow, number)
        self._words(number)
        self.canvas.draw()
        return image.fromarray(np.asarray(self.canvas.buffer_rgba())[..., :3].copy())

    def _bodies(self, number: int) -> None:
        scene, pose = self.scene, self.film.poses[number]
        shapes = scene.outlines
        depths = [scene.depth(pose.points(shape.body, shape.points.mean(axis=0)[None, :])[0]) for shape in shapes]
        for shape, corners, depth in zip(shapes, self.film.silhouettes[number], depths, strict=True):
            self._shape(shape, corners, depth, depths)
        drawn = {shape.body for shape in shapes}
        for body, lines in scene.sticks(pose):
            if body not in drawn:
                for line in lines:
                    flat = scene.flat(line)
                    self.axes.plot(flat[:, 0], flat[:, 1], "-o", color=INK, lw=2.5, ms=4, solid_capstyle="round")

    def _shape(self, outline: Outline, corners: Array, depth: float, depths: list[float]) -> None:
        spread = max(depths) - min(depths)
        near = (depth - min(depths)) / spread if spread > 1e-9 else 1.0
        shade = FAINTEST + (1.0 - FAINTEST) * near
        *color, opacity = outline.color
        still = not self.film.moving[outline.body]
        face = (*(shade * part for part in color), 0.35 * opacity if still else opacity)
        # What does not move is scenery and stays behind.
        edge = INK if not still else (*(0.6 * part for part in color), 0.6)
        order = 1.0 if still else 2.0 + near
        self.axes.add_patch(
            self.patches.Polygon(corners, closed=True, facecolor=face, edgecolor=edge, lw=1.0, zorder=order)
        )

    def _disc(self, pose: Bodies, disc: Disc, load: float) -> None:
        spot = self.scene.flat(pose.points(disc.body, disc.center[None, :]))[0]
        touching = load > 0.0
        self.axes.add_patch(
            self.patches.Circle(
                spot,
                disc.radius,
                facecolor=TOUCHING if touching else "none",
                alpha=0.9 if touching else 1.0,
                edgecolor=INK,
                lw=0.9,
                ls="-" if touching else (0, (3, 2)),
                zorder=4.0,
            )
        )

    def _ground(self, point: Array, normal: Array, center: Array) -> None:
        """A half space: its surface as a line, hatched on the inside. Seen from above it is no line, and not drawn."""
        flat = self.scene.flat(np.array((point, normal)))
        origin, out = flat[0], flat[1]
        steepness = float(np.linalg.norm(out))
        if steepness < 1e-3:
            return
        out = out / steepness
        along = np.array((out[1], -out[0]))
        far = 2.0 * float(np.linalg.norm(self.half))
        middle = origin + along * ((center - origin) @ along)
        thick = 0.055 * self.half[1]
        ends = np.array((middle - far * along, middle + far * along))
        band = np.vstack((ends, ends[::-1] - thick * out))
        self.axes.add_patch(
            self.patches.Polygon(band, closed=True, facecolor="none", edgecolor=EARTH, hatch="////", lw=0.0, zorder=1.5)
        )
        self.axes.plot(ends[:, 0], ends[:, 1], color=INK, lw=1.4, zorder=1.6)

    def _arrow(self, pose: Bodies, arrow: _Arrow, number: int) -> None:
        force = self.scene.flat(arrow.vectors[number][None, :])[0] * self.meters_per_newton
        if float(np.linalg.norm(force)) < 0.01 * self.half[1]:
            return
        sphere, ground = arrow.push.sphere, arrow.push.ground
        spot = pose.points(sphere.body, sphere.center[None, :])[0]
        if ground is not None:
            spot = spot + sphere.radius * pose.vector(ground.body, ground.matrix[:3, 0])
        start = self.scene.flat(spot[None, :])[0]
        self.axes.add_patch(
            self.patches.FancyArrowPatch(
                start,
                start + force,
                arrowstyle="-|>",
                mutation_scale=13,
                lw=2.2,
                color=FORCE,
                shrinkA=0,
                shrinkB=0,
                zorder=5,
            )
        )

    def _words(self, number: int) -> None:
        put = self.axes.text
        box = {"facecolor": SKY, "edgecolor": "none", "alpha": 0.8, "pad": 2.5}
        common = {"transform": self.axes.transAxes, "color": INK, "fontsize": 11, "zorder": 9, "bbox": box}
        put(0.03, 0.945, f"t = {self.film.times[number]:.2f} s", family="monospace", **common)
        put(0.97, 0.945, self.film.mechanism.name, ha="right", **common)
        left, low = self.axes.get_xlim()[0], self.axes.get_ylim()[0]
        length = _round_down(0.4 * self.half[0])
        x, y = left + 0.06 * self.half[0], low + 0.1 * self.half[1]
        self._bar(x, y, length, f"{length:g} m", INK, common)
        if self.meters_per_newton > 0.0:
            newtons = _round_down(0.4 * self.half[0] / self.meters_per_newton)
            x = left + 1.94 * self.half[0] - newtons * self.meters_per_newton
            self._bar(x, y, newtons * self.meters_per_newton, f"{newtons:g} N", FORCE, common)

    def _bar(self, x: float, y: float, length: float, text: str, color: str, common: dict[str, Any]) -> None:
        self.axes.plot((x, x + length), (y, y), color=color, lw=3.0, solid_capstyle="butt", zorder=8)
        style = {**common, "transform": self.axes.transData, "color": color, "fontsize": 9}
        self.axes.text(x + length / 2, y + 0.035 * self.half[1], text, ha="center", va="bottom", **style)


def _round_down(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above a positive value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value * (1 + 1e-9)))
