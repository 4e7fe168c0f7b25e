"""Hypothesis strategies for random mechanisms and states."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from hypothesis import strategies as st

import osimlite
from osimlite.mechanics.multibody import body_constraints as b
from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.constraints import (
    ConstraintEquations,
    Coupler,
    PrescribedCoordinate,
)
from osimlite.mechanics.multibody.joints import (
    PLAIN_JOINTS,
    JointAxis,
    Mobilizer,
    constant_curvature,
    make_custom_motions,
    make_ellipsoid_motions,
    make_plain_motions,
    make_scapulothoracic_motions,
    motion_types,
)
from osimlite.mechanics.multibody.mechanism import (
    CoordinateInfo,
    FramePlacement,
    MassProperties,
    Mechanism,
    MobileBody,
    StationPlacement,
)
from osimlite.mechanics.multibody.motions import JointMotion
from osimlite.mechanics.multibody.spatial import Array, make_offset

MOTIONS = {name: make_plain_motions(getattr(osimlite, name)) for name in PLAIN_JOINTS}


KINDS = ("point", "distance", "line", "weld", "rolling", "coupler", "prescribed")
"""Kinds of constraints that `constraint_of` creates."""

JOINT_TYPES = (
    *MOTIONS,
    "EllipsoidJoint",
    "ScapulothoracicJoint",
    "ConstantCurvatureJoint",
    "CustomJoint",
)


class Case(NamedTuple):
    """Mechanism of n coordinates with a state and accelerations, each (n,)."""

    mechanism: Mechanism
    q: Array
    u: Array
    udot: Array


def _radii(rng: np.random.Generator) -> Array:
    """Return random radii of an ellipsoid (3,) in m; negative radii mirror it."""
    return rng.uniform(0.1, 0.4, 3) * rng.choice((-1.0, 1.0))


def motions_of(joint_type: str, rng: np.random.Generator) -> tuple[JointMotion, ...]:
    """Return the motions of a joint with random properties, from its parent frame to its child frame."""
    if joint_type == "EllipsoidJoint":
        return make_ellipsoid_motions(_radii(rng))
    if joint_type == "ConstantCurvatureJoint":
        return constant_curvature(rng.uniform(0.2, 0.5), rng.uniform(-0.2, 0.2, 3).tolist())
    if joint_type == "ScapulothoracicJoint":
        return make_scapulothoracic_motions(
            _radii(rng), rng.uniform(-0.1, 0.1, 2), rng.uniform(-1.0, 1.0)
        )
    if joint_type == "CustomJoint":
        spline = f.SimmCubicSpline((-1.5, -0.4, 0.3, 1.6), rng.uniform(-0.5, 0.5, 4))
        axes = [
            JointAxis((0,), rng.normal(size=3), f.Linear(-1.0, 0.2)),
            JointAxis((1,), rng.normal(size=3), spline),
            JointAxis((0,), rng.normal(size=3), f.SineWave(0.4, 1.3, 0.2, 0.1)),
            JointAxis((0,), rng.normal(size=3), f.Polynomial((0.3, -0.2, 0.5, 0.1))),
            JointAxis((1,), rng.normal(size=3), f.ScaledFunction(-0.7, spline)),
            JointAxis((), rng.normal(size=3), f.ConstantValue(0.07)),
        ]
        return make_custom_motions(axes[:3], axes[3:])
    return MOTIONS[joint_type]


def coordinates_of(motions: tuple[JointMotion, ...]) -> int:
    """Return the number of coordinates of the motions of a joint."""
    return 1 + max((place for motion in motions for place in motion.coordinates), default=-1)


def make_random_body(
    index: int,
    parent: int,
    joint_type: str,
    turned_round: bool,
    first: int,
    rng: np.random.Generator,
) -> tuple[MobileBody, list[CoordinateInfo]]:
    motions = motions_of(joint_type, rng)
    count = coordinates_of(motions)
    path = f"/jointset/j{index}"
    frames = [make_offset(rng.uniform(-0.4, 0.4, 3), rng.uniform(-1.0, 1.0, 3)) for _ in range(2)]
    mobilizer = Mobilizer(
        path,
        joint_type,
        motions,
        tuple(range(first, first + count)),
        frames[0],
        frames[1],
        turned_round,
    )
    half = rng.uniform(-0.3, 0.3, (3, 3))
    properties = MassProperties(
        rng.uniform(0.5, 3.0), rng.uniform(-0.2, 0.2, 3), half @ half.T + 0.1 * np.eye(3)
    )
    types = motion_types(motions, count)
    infos = [
        CoordinateInfo(f"q{first + k}", f"{path}/q{first + k}", path, types[k])
        for k in range(count)
    ]
    return MobileBody(f"B{index}", f"/bodyset/B{index}", parent, properties, mobilizer), infos


@st.composite
def cases(draw: st.DrawFn, *, max_bodies: int = 5) -> Case:
    """Draw a random tree of random joints, some of them reversed, at a random state."""
    count = draw(st.integers(1, max_bodies))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    bodies: list[MobileBody] = []
    coordinates: list[CoordinateInfo] = []
    for index in range(count):
        joint_type = draw(st.sampled_from(JOINT_TYPES))
        parent, turned_round = draw(st.integers(-1, index - 1)), draw(st.booleans())
        body, infos = make_random_body(
            index, parent, joint_type, turned_round, len(coordinates), rng
        )
        bodies.append(body)
        coordinates += infos
    mechanism = Mechanism("random", tuple(bodies), tuple(coordinates), np.array((0.3, -9.5, 0.7)))
    n = len(coordinates)
    return Case(
        mechanism, rng.uniform(-1.2, 1.2, n), rng.uniform(-2.0, 2.0, n), rng.uniform(-3.0, 3.0, n)
    )


def constraint_of(kind: str, mechanism: Mechanism, rng: np.random.Generator) -> ConstraintEquations:
    """Return a random constraint of a kind between two random bodies."""
    one, two = rng.choice(range(-1, len(mechanism.bodies)), 2, replace=False).tolist()
    first, second = (StationPlacement(body, rng.uniform(-0.3, 0.3, 3)) for body in (one, two))
    match kind:
        case "point":
            return b.PointEquations(first, second)
        case "distance":
            return b.DistanceConstraint(first, second, 0.5)
        case "line":
            return b.PointOnLineEquations(first, rng.normal(size=3), second)
        case "weld":
            inner, outer = (
                make_offset(rng.uniform(-0.3, 0.3, 3), rng.uniform(-1.0, 1.0, 3)) for _ in range(2)
            )
            return b.WeldEquations(FramePlacement(one, inner), FramePlacement(two, outer))
        case "rolling":
            return b.RollingConstraint(one, two, rng.normal(size=3), 0.3)
        case "coupler":
            places = rng.permutation(len(mechanism.coordinates))[:2].tolist()
            return Coupler(
                places[0],
                tuple(places[1:]),
                f.Polynomial((0.3, -0.2, 0.1)) if places[1:] else f.ConstantValue(0.2),
            )
    return PrescribedCoordinate(
        int(rng.integers(len(mechanism.coordinates))), f.SineWave(0.4, 3.0, 0.2, 0.1)
    )
