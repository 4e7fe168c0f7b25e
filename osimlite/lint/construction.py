"""Reasons why a model cannot be computed, for the rules that report them.

The linter works without a numeric library. `osimlite.lint.measuring.construction` builds the
mechanism and the forces, assembles the default pose and evaluates one acceleration. It is loaded by
its name, and only for models whose construction may fail.
"""

from __future__ import annotations

from collections import OrderedDict
from enum import StrEnum
from hashlib import blake2b
from importlib import import_module
from typing import TYPE_CHECKING, cast

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.require import find_missing_packages
from osimlite.errors import OsimliteError
from osimlite.lint.measures import MECHANISM, NEEDS_SIM

if TYPE_CHECKING:
    from osimlite.lint.subject import Subject

CONSTRUCTION = "construction"
"""Value of `Rule.about` for rules that report obstacles to a computation."""

REMEMBERED_MODELS = 16
"""Number of texts whose obstacles stay in memory."""


class Stage(StrEnum):
    """Stage at which a computation stops, or kind of problem that it finds."""

    MECHANISM = "mechanism"
    FORCE = "force"
    CABLE = "cable"
    ASSEMBLY = "assembly"
    CLAMP = "clamp"
    INERTIA = "inertia"
    ACCELERATION = "acceleration"
    RATE = "rate"
    UNSUPPORTED = "unsupported"


class Obstacle(NamedTuple):
    """Reason why a model cannot be computed, or is computed differently from the file."""

    stage: Stage
    path: str  # absolute path of the component at fault, empty if it is not known
    message: str  # description of the obstacle, without the next step


SIMPLE_CLASSES = frozenset(
    (
        "Body",
        "Ground",
        "Model",
        "PinJoint",
        "SliderJoint",
        "WeldJoint",
        "PlanarJoint",
        "Coordinate",
        "PhysicalOffsetFrame",
        "BodySet",
        "JointSet",
        "ForceSet",
        "ConstraintSet",
        "MarkerSet",
        "ControllerSet",
        "ContactGeometrySet",
        "ProbeSet",
        "ComponentSet",
        "ModelVisualPreferences",
        "ModelDisplayHints",
        "FrameGeometry",
        "Appearance",
        "SurfaceProperties",
        "WrapObjectSet",
        "Mesh",
        "Brick",
        "Sphere",
        "Ellipsoid",
        "Cylinder",
        "Cone",
        "Torus",
        "LineGeometry",
        "Arrow",
        "Marker",
        "ContactSphere",
        "ContactHalfSpace",
        "HuntCrossleyForce",
        "HuntCrossleyContactParameters",
        "HuntCrossleyContactParametersSet",
        "CoordinateLimitForce",
        "CoordinateActuator",
        "SpringGeneralizedForce",
        "Constant",
        "LinearFunction",
    )
)
"""Classes that cannot stop a computation where no other rule reports an error."""

_memory: OrderedDict[str, list[Obstacle]] = OrderedDict()


def forget_obstacles() -> None:
    """Remove the obstacles of all models from memory, so that the next check builds a model again."""
    _memory.clear()


def may_fail(subject: Subject) -> bool:
    """Return whether building a model may find more than the rules that need no numbers.

    Trees of pins, slides and planes under simple forces cannot fail if every body has mass and
    inertia; their numbers are checked one by one.
    """
    if any(cls.__name__ not in SIMPLE_CLASSES for cls in subject.by_class):
        return True
    if any(item.prescribed for item in subject.find_by_class("Coordinate")):
        return True
    return any(
        # `not >` includes NaN.
        not body.mass > 0.0 or not min(body.inertia[:3]) > 0.0
        for body in subject.find_by_class("Body")
    )


def find_obstacles(subject: Subject, *, compute: bool = True) -> str:
    """Find the reasons why a model cannot be computed, and cache them in the subject.

    Args:
        subject: check target with the model, which keeps the obstacles.
        compute: whether the model is built if necessary; otherwise only remembered results are used.

    Returns:
        Reason why the obstacles are unknown; empty if they are known.
    """
    if CONSTRUCTION in subject.cache:
        return ""
    if missing := find_missing_packages("numpy"):
        return (
            f"{NEEDS_SIM} ({' and '.join(missing)} is not installed); run: pip install "
            "'osimlite[sim]'"
        )
    key = None if subject.source is None else _compute_digest(subject)
    obstacles = _memory.get(key) if key is not None else None
    if obstacles is None:
        if not compute:
            return "not requested"
        obstacles = _try_construction(subject)
    subject.cache[CONSTRUCTION] = obstacles
    if key is not None:
        _memory[key] = obstacles
        # The editor checks the same text many times; few models are open at once.
        _memory.move_to_end(key)
        while len(_memory) > REMEMBERED_MODELS:
            _memory.popitem(last=False)
    return ""


def obstacles_of(subject: Subject, *stages: Stage) -> list[Obstacle]:
    """Return the obstacles of a model that were found in some stages."""
    obstacles = cast("list[Obstacle]", subject.cache.get(CONSTRUCTION, []))
    return [obstacle for obstacle in obstacles if obstacle.stage in stages]


def _compute_digest(subject: Subject) -> str:
    # Meshes and tables beside the model may be others in another folder.
    text = f"{subject.folder}\n".encode("utf-8", "replace") + subject.data
    return blake2b(text, digest_size=16).hexdigest()


def _try_construction(subject: Subject) -> list[Obstacle]:
    """Return the obstacles that the builder meets; cache the mechanism that it makes."""
    from osimlite.schema.tree import lend_tree

    assert subject.model is not None
    try_construction = import_module("osimlite.lint.measuring.construction").try_construction
    # The mechanism uses the component tree that the rules have made already.
    with lend_tree(subject.tree):
        try:
            result: list[Obstacle]
            result, subject.cache[MECHANISM] = try_construction(subject.model, subject.folder)
        except (ArithmeticError, ValueError, OsimliteError) as error:
            # Other rules report numbers that are too large to compute with.
            result = [Obstacle(Stage.MECHANISM, "", str(getattr(error, "message", error)))]
    return result
