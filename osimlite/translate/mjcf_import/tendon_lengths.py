"""Lengths of spatial tendons, by the rules of MuJoCo 3 or of MuJoCo 4.

The compiled model is the same in both versions; what a side site means is not
(:mod:`osimlite.translate.mjcf.wrapping`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

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
    """The part of a tendon between two sites."""

    first: int  # site
    second: int  # site
    geom: int = -1  # what it may bend around
    side: int = -1  # side site of the geom
    divisor: float = 1.0  # of the branch of a pulley


class Tendon(NamedTuple):
    """A tendon of the compiled model."""

    number: int  # in the compiled model
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
        kind, number = int(model.wrap_type[part]), int(model.wrap_objid[part])
        value = float(model.wrap_prm[part])
        if kind == JOINT:
            joints.append((number, value))
        # A pulley ends a branch: the next site begins a new one.
        elif kind == PULLEY:
            divisor, last, geom, has_pulley = value, -1, -1, True
        elif kind == SITE:
            if last >= 0:
                # A geom between two sites belongs to the segment that the second one ends.
                segments.append(TendonSegment(last, number, geom, side, divisor))
            last, geom, side = number, -1, -1
        else:
            geom, side = number, round(value)
    return Tendon(index, tuple(segments), tuple(joints), has_pulley)


def segment_lengths(
    source: MjcfSource, segments: list[TendonSegment], poses: SampledPoses, version: int
) -> tuple[Array, Array]:
    """Compute the lengths of tendon segments in sampled poses.

    A segment that goes through the inside of a surface and touches it has NaN there.

    Args:
        source: the compiled file.
        segments: the segments.
        poses: the poses.
        version: version of MuJoCo whose rules hold, 3 or 4.

    Returns:
        Lengths (S, P), m, and the parts of them on a surface (S, P), m.
    """
    model = source.model
    first = poses.sites[:, [item.first for item in segments]]
    second = poses.sites[:, [item.second for item in segments]]
    lengths = norm(second - first).T.copy()
    touching = np.zeros_like(lengths)
    # Segments of one kind are computed in one call.
    groups: dict[tuple[str, bool], list[int]] = {}
    for number, item in enumerate(segments):
        if item.geom >= 0:
            kind = "cylinder" if int(model.geom_type[item.geom]) == 5 else "sphere"
            groups.setdefault((kind, item.side >= 0), []).append(number)
    for (kind, sided), members in groups.items():
        geoms = [segments[number].geom for number in members]
        turns, middles = poses.turns[:, geoms], poses.geoms[:, geoms]

        # Points in the frame of each geom; the defaults bind the arrays of this round.
        def local(points: Array, turns: Array = turns, middles: Array = middles) -> Array:
            return np.einsum("psji,psj->spi", turns, points - middles)

        one, two = local(first[:, members]), local(second[:, members])
        sides = (
            local(poses.sites[:, [segments[number].side for number in members]]) if sided else None
        )
        radius = np.array([[float(model.geom_size[geom, 0])] for geom in geoms])
        bends = bend_tendon(kind, radius, one, two, sides, np.arange(len(members)), version)
        rows, columns = np.indices(bends.choice.shape)
        select = (bends.choice, rows, columns)
        touches = bends.touches[select]
        total = (
            norm(bends.first[select] - one)
            + bends.length[select]
            + norm(bends.second[select] - two)
        )
        lengths[members] = np.where(touches, total, lengths[members])
        touching[members] = np.where(touches, bends.length[select], 0.0)
        if sided:
            # Choice 3 leads through the inside, where OpenSim's wraps cannot follow.
            touching[members] = np.where(touches & (bends.choice == 3), np.nan, touching[members])
    return lengths, touching


def tendon_lengths(
    source: MjcfSource, tendons: list[Tendon], poses: SampledPoses, version: int
) -> Array:
    """Return the lengths (T, P) of spatial and fixed tendons, m or rad.

    Args:
        source: the compiled file.
        tendons: the tendons.
        poses: the poses.
        version: version of MuJoCo whose rules hold, 3 or 4.
    """
    model = source.model
    segments = [item for tendon in tendons for item in tendon.segments]
    lengths = segment_lengths(source, segments, poses, version)[0]
    result = np.zeros((len(tendons), len(poses.qpos)))
    start = 0
    for row, tendon in zip(result, tendons, strict=True):
        for offset, item in enumerate(tendon.segments):
            row += lengths[start + offset] / item.divisor
        start += len(tendon.segments)
        for joint, coefficient in tendon.joints:
            row += coefficient * poses.qpos[:, int(model.jnt_qposadr[joint])]
    return result
