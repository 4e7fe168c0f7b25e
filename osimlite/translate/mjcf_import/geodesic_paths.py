"""Tendons as Scholz2015GeometryPaths: shortest curves over contact surfaces, as MuJoCo's are.

OpenSim's wrap cylinders have tangent points that are not quite the shortest way. A
Scholz2015GeometryPath has them exactly, but starts its search from an earlier pose: it can stay on the
wrong side of a surface where MuJoCo jumps to the other one. It is only used for a tendon whose
lengths it has in all sampled poses.
"""

from __future__ import annotations

import numpy as np

from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.contact import ContactGeometry
from osimlite.schema.contact_types import ContactCylinder, ContactSphere
from osimlite.schema.frames import Body, PhysicalFrame
from osimlite.schema.model import Model
from osimlite.schema.paths import PathPoint
from osimlite.schema.scholz_paths import (
    Scholz2015GeometryPath,
    Scholz2015GeometryPathElement,
    Scholz2015GeometryPathObstacle,
    Scholz2015GeometryPathPoint,
)
from osimlite.translate.mjcf.wrapping import bend_tendon, norm
from osimlite.translate.mjcf_import.draft import (
    ConversionDraft,
    angles_of,
    quaternion_matrix,
    vector,
)
from osimlite.translate.mjcf_import.path_comparison import Bench
from osimlite.translate.mjcf_import.poses import SampledPoses, compute_poses
from osimlite.translate.mjcf_import.tendon_lengths import (
    CYLINDER,
    Tendon,
    TendonSegment,
    tendon_lengths,
)

CLOSE_M = 1e-6
"""Largest error of a path over contact surfaces, and error of wrap objects above which one is tried."""
MIN_CLEARANCE_M = 1e-4
"""Least distance of a path point from an obstacle: OpenSim refuses points inside of one."""

Hints = tuple[Array | None, ...]
"""Points near the contacts of the segments of a tendon, in the frames of the geoms (3,), m."""


class Obstacles:
    """Contact surfaces of a model over which paths run, each made when it is first used.

    Args:
        draft: OpenSim model under construction.
        frames: frames that own the surfaces, by body.
        model: model that gets the surfaces.
    """

    def __init__(self, draft: ConversionDraft, frames: list[PhysicalFrame], model: Model) -> None:
        self._draft, self._frames, self._model = draft, frames, model
        self._made: dict[int, ContactGeometry] = {}

    def get(self, geom: int) -> ContactGeometry:
        """Return the surface of a geom."""
        if geom not in self._made:
            draft, mj = self._draft, self._draft.mj
            surface_class = ContactCylinder if is_cylinder(draft, geom) else ContactSphere
            surface = surface_class(
                name=draft.unique("obstacle", f"{draft.source.name_of('geom', geom)}_obstacle"),
                radius=float(mj.geom_size[geom, 0]),
                socket_frame=self._frames[int(mj.geom_bodyid[geom])],
                location=vector(mj.geom_pos[geom]),
                orientation=angles_of(quaternion_matrix(mj.geom_quat[geom])),
            )
            self._model.add(surface)
            self._made[geom] = surface
        return self._made[geom]


def is_cylinder(draft: ConversionDraft, geom: int) -> bool:
    """Return whether a geom is a cylinder; others that tendons bend around are spheres."""
    return int(draft.mj.geom_type[geom]) == CYLINDER


def find_default_pose(draft: ConversionDraft) -> SampledPoses:
    """Return the default pose of the converted model as poses of one row."""
    model = draft.mj
    qpos = np.array(model.qpos0)
    for key in range(model.nkey):
        if draft.source.name_of("key", key) == draft.options.keyframe:
            qpos = np.array(model.key_qpos[key])
    return compute_poses(draft.source, qpos[None, :])


def find_hint(
    draft: ConversionDraft, segment: TendonSegment, pose: SampledPoses, version: int
) -> Array | None:
    """Return a point (3,) near the contact of a segment with its geom in the default pose.

    It is the middle of the contact, or where the straight segment is nearest to the geom, moved to
    the surface.

    Args:
        draft: OpenSim model under construction.
        segment: segment of a tendon that has a geom.
        pose: default pose of MuJoCo's model.
        version: version of MuJoCo whose rules hold.

    Returns:
        The point in the frame of the geom, m; None if an end of the segment is inside of the geom,
        so that no path over the surface exists.
    """
    radius = float(draft.mj.geom_size[segment.geom, 0])
    rotation, center = pose.rotations[0, segment.geom], pose.geoms[0, segment.geom]
    first_point, second_point = (
        rotation.T @ (pose.sites[0, site] - center) for site in (segment.first, segment.second)
    )
    axis_mask = np.array((1.0, 1.0, 0.0 if is_cylinder(draft, segment.geom) else 1.0))
    if (
        min(np.linalg.norm(axis_mask * end) for end in (first_point, second_point))
        < radius + MIN_CLEARANCE_M
    ):
        return None
    side_site = None
    if segment.side >= 0:
        side_site = (rotation.T @ (pose.sites[0, segment.side] - center))[None, None]
    bends = bend_tendon(
        "cylinder" if axis_mask[2] == 0.0 else "sphere",
        np.array([[radius]]),
        first_point[None, None],
        second_point[None, None],
        side_site,
        np.arange(1),
        version,
    )
    choice = int(bends.choice[0, 0])
    if bends.touches[choice, 0, 0]:
        point = 0.5 * (bends.first[choice, 0, 0] + bends.second[choice, 0, 0])
    else:
        direction = axis_mask * (second_point - first_point)
        size = float(direction @ direction)
        fraction = (
            0.5 if size == 0.0 else np.clip(-(axis_mask * first_point) @ direction / size, 0.0, 1.0)
        )
        point = first_point + fraction * (second_point - first_point)
    distance = float(np.linalg.norm(axis_mask * point))
    # On the axis or in the centre no direction leads to the surface.
    if distance < 1e-9:
        return None
    # A cylinder keeps the height of the point.
    return np.asarray(
        axis_mask * point * (radius / distance) + (1.0 - axis_mask) * point, dtype=float
    )


def make_geodesic_path(
    draft: ConversionDraft,
    frames: list[PhysicalFrame],
    obstacles: Obstacles,
    segments: tuple[TendonSegment, ...],
    hints: Hints,
) -> Scholz2015GeometryPath:
    """Make a path through the sites of a tendon and over its geoms.

    Args:
        draft: OpenSim model under construction.
        frames: frames of the bodies.
        obstacles: surfaces that paths run over.
        segments: segments of a tendon with one branch.
        hints: point near the contact of each segment, in the frame of its geom (3,), m; None for a
            straight segment.

    Returns:
        Path with a point for each site, and an obstacle for each segment with a hint.
    """
    model = draft.mj

    def make_point(site: int, number: int) -> Scholz2015GeometryPathPoint:
        return Scholz2015GeometryPathPoint(
            name=f"point_{number}",
            path_point=PathPoint(
                name=draft.source.name_of("site", site),
                socket_parent_frame=frames[int(model.site_bodyid[site])],
                location=vector(model.site_pos[site]),
            ),
        )

    elements: list[Scholz2015GeometryPathElement] = [make_point(segments[0].first, 1)]
    for number, (segment, hint) in enumerate(zip(segments, hints, strict=True), 1):
        if hint is not None:
            elements.append(
                Scholz2015GeometryPathObstacle(
                    name=f"obstacle_{number}",
                    socket_contact_geometry=obstacles.get(segment.geom),
                    contact_hint=vector(hint),
                )
            )
        elements.append(make_point(segment.second, number + 1))
    return Scholz2015GeometryPath(name="path", path_elements=elements)


def find_hints(
    draft: ConversionDraft, segments: tuple[TendonSegment, ...], version: int
) -> Hints | None:
    """Return hints for the segments of a tendon; None if no path over surfaces is possible.

    Points and surfaces must be in bodies or in ground: OpenSim ignores the pose of other frames in
    such a path.
    """
    pose = find_default_pose(draft)
    model = draft.mj
    ground = draft.model.ground
    hints: list[Array | None] = []
    for segment in segments:
        owners = [int(model.site_bodyid[site]) for site in (segment.first, segment.second)]
        owners += [int(model.geom_bodyid[segment.geom])] if segment.geom >= 0 else []
        frames = [draft.frames[body] for body in owners]
        # OpenSim 4.6 ignores the pose of offset frames in these paths.
        if not all(isinstance(frame, Body) or frame is ground for frame in frames):
            return None
        if segment.geom < 0:
            hints.append(None)
            continue
        hint = find_hint(draft, segment, pose, version)
        if hint is None:
            return None
        hints.append(hint)
    return tuple(hints)


def measure_clearance(draft: ConversionDraft, segment: TendonSegment, poses: SampledPoses) -> float:
    """Return the smallest distance (m) of the ends of a segment from its geom, negative inside."""
    axis = poses.rotations[:, segment.geom, :, 2]
    result = np.inf
    for site in (segment.first, segment.second):
        offset = poses.sites[:, site] - poses.geoms[:, segment.geom]
        if is_cylinder(draft, segment.geom):
            offset = offset - np.einsum("pi,pi->p", offset, axis)[:, None] * axis
        result = min(result, float(norm(offset).min()))
    return result - float(draft.mj.geom_size[segment.geom, 0])


def select_geodesics(
    draft: ConversionDraft, tendons: list[Tendon], trials: list[SampledPoses], version: int
) -> dict[int, Hints]:
    """Select those tendons that paths over contact surfaces follow in all poses.

    A path that fails in one pose can be off by metres, so that many poses are needed.

    Args:
        draft: OpenSim model under construction.
        tendons: spatial tendons that wrap objects do not follow closely.
        trials: sets of poses; each is tried with the tendons that are left.
        version: version of MuJoCo whose rules hold.

    Returns:
        Hints by the index of the tendon in the list.
    """
    selected: dict[int, Hints] = {}
    for row, tendon in enumerate(tendons):
        hints = None if tendon.has_pulley else find_hints(draft, tendon.segments, version)
        if hints is not None:
            selected[row] = hints

    def make_bench() -> Bench:
        # Names of earlier trial surfaces are free again.
        draft.names.pop("obstacle", None)
        bench = Bench(draft)
        obstacles = Obstacles(draft, bench.frames, bench.model)
        for row, hints in selected.items():
            bench.add(
                make_geodesic_path(draft, bench.frames, obstacles, tendons[row].segments, hints)
            )
        return bench

    unsolvable = make_bench().find_unsolvable() if selected else set()
    selected = {
        row: hints
        for number, (row, hints) in enumerate(selected.items())
        if number not in unsolvable
    }
    for poses in trials:
        selected = {
            row: hints
            for row, hints in selected.items()
            if all(
                measure_clearance(draft, segment, poses) > 0.0
                for segment in tendons[row].segments
                if segment.geom >= 0
            )
        }
        if not selected:
            break
        lengths, _, _ = make_bench().measure(poses.qpos)
        target_lengths = tendon_lengths(
            draft.source, [tendons[row] for row in selected], poses, version
        )
        # A comparison with NaN is False, so that paths without a solution are left out.
        is_close = np.all(np.abs(lengths - target_lengths) <= CLOSE_M, axis=1).tolist()
        selected = {
            row: hints
            for (row, hints), is_good in zip(selected.items(), is_close, strict=True)
            if is_good
        }
    return selected
