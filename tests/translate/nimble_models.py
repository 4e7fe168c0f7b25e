"""Models that Nimble moves in another way than OpenSim, and how they are rewritten."""

from __future__ import annotations

from collections.abc import Sequence

import osimlite

PLACES = ("rotation1", "rotation2", "rotation3", "translation1", "translation2", "translation3")
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
Axis = tuple[tuple[float, float, float], osimlite.Function, str]


def line(slope: float = 1.0, offset: float = 0.0) -> osimlite.LinearFunction:
    return osimlite.LinearFunction(coefficients=(slope, offset))


def constant(value: float = 0.0) -> osimlite.Constant:
    return osimlite.Constant(value=value)


def poly(*coefficients: float) -> osimlite.PolynomialFunction:
    return osimlite.PolynomialFunction(coefficients=coefficients)


def make_model(joint: osimlite.Joint) -> osimlite.Model:
    model = osimlite.Model(name="m")
    inertia = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
    body = model.add(osimlite.Body(name="b", mass=1.0, inertia=inertia))
    model.add(
        joint.between(
            model.ground,
            body,
            at=(0.1, 0.2, 0.3),
            turned=(0.4, -0.5, 0.6),
            child_at=(0.0, 0.1, 0.0),
        )
    )
    return model


def make_custom(axes: Sequence[Axis], names: Sequence[str]) -> osimlite.Model:
    transform = {
        place: osimlite.TransformAxis(
            name=place, axis=axis, function=function, coordinates=(name,) if name else ()
        )
        for place, (axis, function, name) in zip(PLACES, axes, strict=True)
    }
    return make_model(
        osimlite.CustomJoint(
            name="j",
            coordinates=[osimlite.Coordinate(name=name, range=(-2.0, 2.0)) for name in names],
            spatial_transform=osimlite.SpatialTransform(**transform),
        )
    )


def make_ellipsoid() -> osimlite.Model:
    names = ("scapula_abduction", "scapula_elevation", "scapula_upward_rot")
    coordinates = [osimlite.Coordinate(name=name) for name in names]
    return make_model(
        osimlite.EllipsoidJoint(name="j", coordinates=coordinates, radii_x_y_z=(0.07, -0.15, 0.09))
    )


ROTATIONS = (
    (Z, line(), "a"),
    (X, line(), "b"),
    (Y, line(), "c"),
)
NEUTRAL = ((X, constant(), ""), (Y, constant(), ""), (Z, constant(), ""))
CUSTOM: dict[str, tuple[Sequence[Axis], str, Sequence[Axis] | None]] = {
    # axes of the file; coordinates; axes that describe Nimble's motion, None if it is OpenSim's
    "offset of one rotation": (
        (
            (Z, line(1.0, 0.3), "a"),
            (X, constant(0.4), ""),
            (Y, constant(), ""),
            (X, constant(), ""),
            (Y, constant(0.2), ""),
            (Z, constant(), ""),
        ),
        "a",
        ((Z, line(), "a"), *NEUTRAL[:2], *NEUTRAL),
    ),
    "slope of one translation": (
        (*NEUTRAL, (X, constant(), ""), (Y, line(0.5, 0.1), "a"), (Z, constant(), "")),
        "a",
        (*NEUTRAL, NEUTRAL[0], (Y, line(), "a"), NEUTRAL[2]),
    ),
    "slopes of two rotations": (
        (
            (Z, constant(0.1), ""),
            (X, line(2.0), "a"),
            (Y, line(-1.0, 0.2), "b"),
            NEUTRAL[0],
            (Y, constant(0.2), ""),
            NEUTRAL[2],
        ),
        "ab",
        ((Z, constant(), ""), (X, line(), "a"), (Y, line(-1.0), "b"), *NEUTRAL),
    ),
    "translations beside three rotations": (
        (*ROTATIONS, (X, line(), "a"), (Y, constant(0.2), ""), NEUTRAL[2]),
        "abc",
        (*ROTATIONS, *NEUTRAL),
    ),
    "names in another order": (
        ((Z, line(), "b"), (X, line(), "a"), (Y, line(), "c"), *NEUTRAL),
        "abc",
        (*ROTATIONS, *NEUTRAL),
    ),
    "flipped translations of a free joint": (
        (
            *ROTATIONS,
            ((-1.0, 0.0, 0.0), line(), "d"),
            (Y, line(2.0), "e"),
            (Z, line(1.0, 0.3), "f"),
        ),
        "abcdef",
        (*ROTATIONS, (X, line(), "d"), (Y, line(), "e"), (Z, line(), "f")),
    ),
    "negative translation beside a curve": (
        (
            (X, line(), "a"),
            NEUTRAL[1],
            NEUTRAL[2],
            ((-1.0, 0.0, 0.0), poly(1.0, 0.2), "a"),
            (Y, constant(0.1), ""),
            NEUTRAL[2],
        ),
        "a",
        ((X, line(), "a"), NEUTRAL[1], NEUTRAL[2], NEUTRAL[0], (Y, constant(0.1), ""), NEUTRAL[2]),
    ),
    "offset with a negative slope beside a curve": (
        ((X, line(-1.0, 0.1), "a"), (Y, poly(1.0, 0.2), "a"), NEUTRAL[2], *NEUTRAL),
        "a",
        ((X, line(-1.0, -0.1), "a"), (Y, poly(1.0, 0.2), "a"), NEUTRAL[2], *NEUTRAL),
    ),
    "slopes and offsets beside a curve": (
        (
            (X, poly(1.0, 0.0), "a"),
            (Y, line(2.0, 0.1), "b"),
            (Z, constant(0.2), ""),
            (X, constant(0.3), ""),
            NEUTRAL[1],
            NEUTRAL[2],
        ),
        "ab",
        None,
    ),
    "negative slope": (
        (((0.6, 0.8, 0.0), line(-1.0), "a"), NEUTRAL[1], NEUTRAL[2], *NEUTRAL),
        "a",
        None,
    ),
    "translations in another order": (
        (
            (X, line(), "a"),
            (Y, poly(1.0, 0.2), "a"),
            NEUTRAL[2],
            (Y, line(2.0), "a"),
            (X, constant(0.1), ""),
            NEUTRAL[2],
        ),
        "a",
        None,
    ),
}
