"""A model as outlines in a plane: what there is to draw, and where it is at a pose."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import cos, pi, sin
from typing import Literal, NamedTuple, cast

import numpy as np

from osimlite.errors import OsimliteError
from osimlite.multibody.mechanism import Mechanism
from osimlite.multibody.spatial import Array, offset
from osimlite.schema.contact import ContactGeometry, ContactHalfSpace, ContactSphere
from osimlite.schema.forces import HuntCrossleyForce
from osimlite.schema.model import Model
from osimlite.schema.tree import Tree, Use
from osimlite.translate.shapes import Ball, Box, MeshFile, Tube, Visual
from osimlite.translate.visuals import collect_visuals

Plane = Literal["xy", "yz", "xz"]

_AXES: Mapping[str, tuple[Array, Array]] = {
    "xy": (np.array((1.0, 0.0, 0.0)), np.array((0.0, 1.0, 0.0))),
    "yz": (np.array((0.0, 0.0, -1.0)), np.array((0.0, 1.0, 0.0))),
    "xz": (np.array((1.0, 0.0, 0.0)), np.array((0.0, 0.0, -1.0))),
}
"""To the right and up in each plane. The viewer looks along their cross product, from its positive side:
along -Z, -X (so that Z points to the left) and -Y (so that Z points down)."""


_CIRCLE = np.array([(cos(2.0 * pi * k / 64), sin(2.0 * pi * k / 64)) for k in range(64)])


class Placed(NamedTuple):
    """Something at a fixed place in a body (index, -1 for ground)."""

    body: int
    matrix: Array


@dataclass(frozen=True, eq=False)
class Outline:
    """Points (k, 3) of a body's frame whose hull, grown by `radius` (m), is the shape.

    A ball is its centre and a radius, other shapes are their corners. `color` is red, green, blue, opacity.
    """

    body: int
    points: Array
    color: tuple[float, float, float, float]
    radius: float = 0.0


@dataclass(frozen=True, eq=False)
class Disc:
    """A contact sphere: centre (3,) in its body's frame and radius (m); `frame` is the name of its own frame."""

    name: str
    frame: str
    body: int
    center: Array
    radius: float


@dataclass(frozen=True, eq=False)
class Push:
    """Where the force of one element is shown: on the sphere that feels it, towards the half space it meets."""

    element: str
    sphere: Disc
    ground: Placed | None


class Bodies(NamedTuple):
    """Poses of all bodies: rotations (b + 1, 3, 3) and origins (b + 1, 3) in ground; the last is ground itself."""

    rotations: Array
    origins: Array

    def points(self, body: int, points: Array) -> Array:
        """Points (k, 3) of a body's frame, in ground."""
        return cast("Array", points @ self.rotations[body].T + self.origins[body])

    def vector(self, body: int, vector: Array) -> Array:
        """A direction (3,) of a body's frame, in ground."""
        return cast("Array", self.rotations[body] @ vector)


class Scene:
    """The shapes, contact surfaces and joints of a model, seen along the normal of a plane."""

    def __init__(self, model: Model, mechanism: Mechanism, plane: Plane = "xy") -> None:
        if plane not in _AXES:
            raise OsimliteError(f"a picture shows the plane 'xy', 'yz' or 'xz', not '{plane}'")
        self.mechanism = mechanism
        self.right, self.up = _AXES[plane]
        self.towards = np.cross(self.right, self.up)
        index = {body.path: place for place, body in enumerate(mechanism.bodies)} | {"/ground": -1}
        visuals = collect_visuals(model, mechanism)
        self.outlines = [
            Outline(index[path], points, visual.color, visual.shape.radius if isinstance(visual.shape, Ball) else 0.0)
            for path, shapes in visuals.by_body.items()
            for visual in shapes
            for points in (_points(visual, visuals.files),)
            if points is not None
        ]
        self.discs: dict[str, Disc] = {}
        self.planes: dict[str, Placed] = {}
        self._contact_surfaces(model)
        self.pushes = list(self._pushes(model))

    def at(self, q: Array) -> Bodies:
        """Where all bodies are at coordinate values q (n,)."""
        state = self.mechanism.at(q)
        return Bodies(state.rotations, state.origins)

    def flat(self, points: Array) -> Array:
        """Points (k, 3) in ground as they appear in the plane (k, 2)."""
        return np.column_stack((points @ self.right, points @ self.up))

    def silhouette(self, bodies: Bodies, outline: Outline) -> Array:
        """Corners (m, 2) of a shape as it appears in the plane, counter-clockwise."""
        flat = self.flat(bodies.points(outline.body, outline.points))
        return flat[0] + outline.radius * _CIRCLE if outline.radius > 0.0 else hull(flat)

    def depth(self, point: Array) -> float:
        """How near a point (3,) in ground is to the viewer."""
        return float(point @ self.towards)

    def sticks(self, bodies: Bodies) -> list[tuple[int, Array]]:
        """For every body, lines (k, 2, 3) in ground from its own joint to the joints of the bodies it carries.

        A body that carries nothing gets a line to its mass centre.
        """
        everyone = self.mechanism.bodies
        joints = []
        for index, body in enumerate(everyone):
            own = body.mobilizer.parent_frame if body.mobilizer.reversed else body.mobilizer.child_frame
            joints.append(bodies.points(index, own[None, :3, 3])[0])
        lines: list[tuple[int, Array]] = []
        for index, body in enumerate(everyone):
            ends = [joints[k] for k, other in enumerate(everyone) if other.parent == index]
            center = bodies.points(index, body.mass_properties.center[None, :])[0]
            lines.append((index, np.array([(joints[index], end) for end in ends or [center]])))
        return lines

    def _contact_surfaces(self, model: Model) -> None:
        tree = model.tree()
        for surface in tree.components:
            if not isinstance(surface, ContactGeometry):
                continue
            path = tree.path_of(surface) or ""
            frame = tree.path_of(tree.target(surface, "socket_frame", surface.socket_frame))
            body, where = self.mechanism.placement(frame or "")
            matrix = where @ offset(surface.location, surface.orientation)
            if isinstance(surface, ContactSphere):
                self.discs[path] = Disc(
                    surface.name, (frame or "").rsplit("/", 1)[-1], body, matrix[:3, 3], surface.radius
                )
            elif isinstance(surface, ContactHalfSpace):
                self.planes[path] = Placed(body, matrix)

    def _pushes(self, model: Model) -> Iterator[Push]:
        tree = model.tree()
        for use in tree.uses():
            if not isinstance(use.owner, HuntCrossleyForce) or use.spec.name != "geometry":
                continue
            path = self._surface(tree, use)
            if path in self.discs:
                others = [self._surface(tree, other) for other in tree.uses() if other.holder is use.holder]
                ground = next((self.planes[other] for other in others if other in self.planes), None)
                yield Push(use.owner.name, self.discs[path], ground)

    @staticmethod
    def _surface(tree: Tree, use: Use) -> str:
        target = tree.resolve(use).target
        return "" if target is None else tree.path_of(target) or ""


def hull(points: Array) -> Array:
    """Corners (m, 2) of the convex hull of points (k, 2), counter-clockwise (Andrew's monotone chain)."""
    ordered = sorted({(float(x), float(y)) for x, y in points})
    if len(ordered) < 3:
        return np.array(ordered)

    def half(chain: list[tuple[float, float]]) -> list[tuple[float, float]]:
        result: list[tuple[float, float]] = []
        for point in chain:
            while len(result) > 1 and _left_of(result[-2], result[-1], point) <= 0.0:
                result.pop()
            result.append(point)
        return result[:-1]

    return np.array(half(ordered) + half(ordered[::-1]))


def _left_of(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _points(visual: Visual, files: Mapping[str, bytes]) -> Array | None:
    """Points (k, 3) in the body's frame whose hull is the shape (of a ball, its centre); None for a file but OBJ."""
    match visual.shape:
        case Box(size):
            corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
            points = corners * size
        case Ball():
            points = np.zeros((1, 3))
        case Tube(radius, length):
            around = [2.0 * pi * k / 48 for k in range(48)]
            points = np.array([(radius * cos(a), radius * sin(a), z * length / 2) for a in around for z in (-1, 1)])
        case MeshFile(file, scale):
            lines = [line.split() for line in files.get(file, b"").decode(errors="ignore").splitlines()]
            vertices = [[float(word) for word in words[1:4]] for words in lines if words and words[0] == "v"]
            if not file.endswith(".obj") or not vertices:
                return None
            points = np.array(vertices) * scale
    turned: Array = points @ visual.origin[:3, :3].T + visual.origin[:3, 3]
    return turned
