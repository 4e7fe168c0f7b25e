"""Points and wrap surfaces of OpenSim paths for the parts of a tendon."""

from __future__ import annotations

from typing import Literal

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.paths import (
    AbstractPathPoint,
    GeometryPath,
    PathPoint,
    PathPointSet,
    PathWrap,
    PathWrapSet,
)
from osimlite.schema.wrap_types import WrapCylinder, WrapSphere
from osimlite.schema.wrapping import WrapObject
from osimlite.translate.mjcf_import.draft import (
    ConversionDraft,
    angles_of,
    quaternion_matrix,
    vector,
)
from osimlite.translate.mjcf_import.tendon_lengths import TendonSegment

Quadrant = Literal["all", "+x"]

CYLINDER_MARGIN_M = 0.2
"""Length that a wrap cylinder has more than the sampled paths need; MuJoCo's has no ends."""


class WrapKey(NamedTuple):
    """A wrap surface: a geom, and the side of it on which paths stay."""

    geom: int
    side: int  # site that the local x axis points to; -1 if paths may go around either side


class Surfaces:
    """Wrap surfaces of a model, each made when it is first used.

    Args:
        draft: OpenSim model under construction.
        frames: frames that own the surfaces, by body.
        max_heights: largest distance (m) along the axis of a cylinder at which a tendon ends, by
            index of the geom.
    """

    def __init__(
        self, draft: ConversionDraft, frames: list[PhysicalFrame], max_heights: dict[int, float]
    ) -> None:
        self._draft, self._frames, self._reach = draft, frames, max_heights
        self._made: dict[WrapKey, str] = {}
        self._names: set[str] = set()

    def name(self, key: WrapKey) -> str:
        """Return the name of a surface."""
        if key not in self._made:
            self._made[key] = self._make(key)
        return self._made[key]

    def _make(self, key: WrapKey) -> str:
        draft, model = self._draft, self._draft.mj
        # Each side of a geom is a surface of its own.
        name = draft.source.name_of("geom", key.geom)
        if key.side >= 0:
            name = f"{name}_{draft.source.name_of('site', key.side)}"
        name = draft.unique("wrap", name)
        radius = float(model.geom_size[key.geom, 0])
        surface: WrapObject
        if int(model.geom_type[key.geom]) == 5:
            drawn_length = 2.0 * float(model.geom_size[key.geom, 1])
            # Cylinders of MuJoCo have no ends, so that theirs must be beyond all paths.
            needed_length = 2.0 * self._reach.get(key.geom, 0.0) + CYLINDER_MARGIN_M
            surface = WrapCylinder(
                name=name, radius=radius, length=max(drawn_length, needed_length)
            )
        else:
            surface = WrapSphere(name=name, radius=radius)
        rotation = quaternion_matrix(model.geom_quat[key.geom])
        surface.quadrant = "all"
        if key.side >= 0:
            rotation = rotation @ turn_to_side(draft, key)
            surface.quadrant = "+x"
        surface.xyz_body_rotation = angles_of(rotation)
        surface.translation = vector(model.geom_pos[key.geom])
        body = int(model.geom_bodyid[key.geom])
        self._frames[body].wrap_object_set.objects.append(surface)
        return name


def turn_to_side(draft: ConversionDraft, key: WrapKey) -> Array:
    """Return the rotation (3, 3) in the frame of a geom whose x axis points to the side site.

    The z axis stays that of a cylinder. The site may be on another body; then its place in the
    default pose counts.
    """
    source, model = draft.source, draft.mj
    # Kinematics alone: no forces are needed for places.
    data = source.mujoco.MjData(model)
    source.mujoco.mj_kinematics(model, data)
    geom_rotation = data.geom_xmat[key.geom].reshape(3, 3)
    side_direction = geom_rotation.T @ (data.site_xpos[key.side] - data.geom_xpos[key.geom])
    # Across the axis of the cylinder.
    if int(model.geom_type[key.geom]) == 5:
        side_direction = np.array((side_direction[0], side_direction[1], 0.0))
        reference = np.array((0.0, 0.0, 1.0))
    else:
        reference = np.eye(3)[int(np.argmin(np.abs(side_direction)))]
    length = np.linalg.norm(side_direction)
    # A side site in the middle gives no direction.
    if length < 1e-12:
        return np.eye(3)
    x = side_direction / length
    y = np.cross(reference, x)
    y /= np.linalg.norm(y)
    return np.column_stack((x, y, np.cross(x, y)))


def make_geometry_path(
    draft: ConversionDraft,
    frames: list[PhysicalFrame],
    surfaces: Surfaces,
    segments: tuple[TendonSegment, ...],
    quadrants: tuple[Quadrant | None, ...],
) -> GeometryPath:
    """Make a path through the sites of a tendon.

    Args:
        draft: OpenSim model under construction.
        frames: frames of the bodies.
        surfaces: surfaces that paths wrap around.
        segments: segments of a tendon with one branch.
        quadrants: part of its surface around which each segment wraps: ``"all"`` for either side,
            ``"+x"`` for the side of the side site, None for no wrapping.

    Returns:
        Path with a point for each site, and a wrap for each segment that wraps.
    """
    model = draft.mj
    sites = [segments[0].first, *(segment.second for segment in segments)]
    used_names: set[str] = set()
    points: list[AbstractPathPoint] = []
    for number, site in enumerate(sites):
        name = draft.source.name_of("site", site)
        # Names of path points have a limited set of characters.
        name = "".join(letter if letter.isalnum() or letter in "_.-" else "_" for letter in name)
        if name in used_names:
            name = f"{name}_{number + 1}"
        used_names.add(name)
        points.append(
            PathPoint(
                name=name,
                socket_parent_frame=frames[int(model.site_bodyid[site])],
                location=vector(model.site_pos[site]),
            )
        )
    wraps = []
    for number, (segment, quadrant) in enumerate(zip(segments, quadrants, strict=True), 1):
        if quadrant is None or segment.geom < 0:
            continue
        key = WrapKey(segment.geom, segment.side if quadrant == "+x" else -1)
        wraps.append(
            PathWrap(
                name=f"pathwrap_{number}",
                wrap_object=surfaces.name(key),
                range=(number, number + 1),
            )
        )
    return GeometryPath(
        name="path",
        path_point_set=PathPointSet(objects=points),
        path_wrap_set=PathWrapSet(objects=wraps),
    )
