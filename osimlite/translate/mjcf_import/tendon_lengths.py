"""Lengths of spatial tendons, by the rules of MuJoCo 3 or of MuJoCo 4.

The compiled model is the same in both versions; what a side site means is not
(:mod:`osimlite.translate.mjcf.wrapping`).
"""

from __future__ import annotations

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.multibody.spatial import Array
from osimlite.translate.mjcf.wrapping import bend_tendon, norm
from osimlite.translate.mjcf_import.poses import SampledPoses
from osimlite.translate.mjcf_import.source import MjcfSource

JOINT = 1
"""MuJoCo's ``mjWRAP_JOINT``."""

PULLEY = 2
"""MuJoCo's ``mjWRAP_PULLEY``."""

SITE = 3
"""MuJoCo's ``mjWRAP_SITE``."""

SPHERE = 4
"""MuJoCo's ``mjWRAP_SPHERE``."""

CYLINDER = 5
"""MuJoCo's ``mjWRAP_CYLINDER``."""


class TendonSegment(NamedTuple):
    """Part of a tendon between two sites."""

    first: int  # index of the first site
    second: int  # index of the second site
    geom: int = -1  # geom around which the segment may bend; -1 for none
    side: int = -1  # side site of the geom; -1 for none
    divisor: float = 1.0  # divisor of the branch of a pulley


class Tendon(NamedTuple):
    """Tendon of the compiled model."""

    number: int  # index in the compiled model
    segments: tuple[TendonSegment, ...]
    joints: tuple[tuple[int, float], ...]  # joints and coefficients of a fixed tendon
    has_pulley: bool

    @property
    def is_fixed(self) -> bool:
        """True if the length is a linear function of joint positions."""
        return bool(self.joints)


def read_tendon(source: MjcfSource, index: int) -> Tendon:
    """Return a tendon of the compiled model."""
    model = source.model
    first = int(model.tendon_adr[index])
    parts = range(first, first + int(model.tendon_num[index]))
    segments: list[TendonSegment] = []
    joints: list[tuple[int, float]] = []
    divisor, has_pulley = 1.0, False
    last, geom, side = -1, -1, -1
    for part in parts:
        part_type, number = int(model.wrap_type[part]), int(model.wrap_objid[part])
        value = float(model.wrap_prm[part])
        if part_type == JOINT:
            joints.append((number, value))
        # A pulley ends a branch: the next site begins a new one.
        elif part_type == PULLEY:
            divisor, last, geom, has_pulley = value, -1, -1, True
        elif part_type == SITE:
            if last >= 0:
                # A geom between two sites belongs to the segment that the second one ends.
                segments.append(TendonSegment(last, number, geom, side, divisor))
            last, geom, side = number, -1, -1
        else:
            geom = number
            side = round(value)
    return Tendon(index, tuple(segments), tuple(joints), has_pulley)


def segment_lengths(
    source: MjcfSource, segments: list[TendonSegment], poses: SampledPoses, version: int
) -> tuple[Array, Array]:
    """Compute the lengths of tendon segments in sampled poses.

    A segment that goes through the inside of a surface and touches it has NaN there.

    Args:
        source: compiled MJCF file.
        segments: segments of tendons (S).
        poses: poses of MuJoCo's model (P).
        version: version of MuJoCo whose rules hold, 3 or 4.

    Returns:
        Lengths (S, P), m, and the parts of them on a surface (S, P), m.
    """
    model = source.model
    first = poses.sites[:, [segment.first for segment in segments]]
    second = poses.sites[:, [segment.second for segment in segments]]
    lengths = norm(second - first).T.copy()
    contact_lengths = np.zeros_like(lengths)
    # Segments of one kind are computed in one call.
    groups: dict[tuple[str, bool], list[int]] = {}
    for number, segment in enumerate(segments):
        if segment.geom >= 0:
            surface_type = "cylinder" if int(model.geom_type[segment.geom]) == 5 else "sphere"
            groups.setdefault((surface_type, segment.side >= 0), []).append(number)
    for (surface_type, has_side), members in groups.items():
        geoms = [segments[number].geom for number in members]
        rotations, centers = poses.rotations[:, geoms], poses.geoms[:, geoms]

        # Points in the frame of each geom; the defaults bind the arrays of this round.
        def local(points: Array, rotations: Array = rotations, centers: Array = centers) -> Array:
            return np.einsum("psji,psj->spi", rotations, points - centers)

        local_first, local_second = local(first[:, members]), local(second[:, members])
        side_sites = (
            local(poses.sites[:, [segments[number].side for number in members]])
            if has_side
            else None
        )
        radius = np.array([[float(model.geom_size[geom, 0])] for geom in geoms])
        bends = bend_tendon(
            surface_type,
            radius,
            local_first,
            local_second,
            side_sites,
            np.arange(len(members)),
            version,
        )
        rows, columns = np.indices(bends.choice.shape)
        selection = (bends.choice, rows, columns)
        is_touching = bends.touches[selection]
        total = (
            norm(bends.first[selection] - local_first)
            + bends.length[selection]
            + norm(bends.second[selection] - local_second)
        )
        lengths[members] = np.where(is_touching, total, lengths[members])
        contact_lengths[members] = np.where(is_touching, bends.length[selection], 0.0)
        if has_side:
            # Choice 3 leads through the inside, where OpenSim's wraps cannot follow.
            contact_lengths[members] = np.where(
                is_touching & (bends.choice == 3), np.nan, contact_lengths[members]
            )
    return lengths, contact_lengths


def tendon_lengths(
    source: MjcfSource, tendons: list[Tendon], poses: SampledPoses, version: int
) -> Array:
    """Return the lengths (T, P) of spatial and fixed tendons, m or rad.

    Args:
        source: compiled MJCF file.
        tendons: tendons to measure (T).
        poses: poses of MuJoCo's model (P).
        version: version of MuJoCo whose rules hold, 3 or 4.
    """
    model = source.model
    segments = [segment for tendon in tendons for segment in tendon.segments]
    lengths = segment_lengths(source, segments, poses, version)[0]
    result = np.zeros((len(tendons), len(poses.qpos)))
    start = 0
    for row, tendon in zip(result, tendons, strict=True):
        for offset, segment in enumerate(tendon.segments):
            row += lengths[start + offset] / segment.divisor
        start += len(tendon.segments)
        for joint, coefficient in tendon.joints:
            row += coefficient * poses.qpos[:, int(model.jnt_qposadr[joint])]
    return result
