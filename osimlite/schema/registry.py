"""Which class stands for which XML tag, and the module that declares it.

Modules are imported when a tag is first met, so that reading a model costs only the areas it uses. A test holds this
table to the classes that exist.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module

from osimlite.schema.base import Object

_AREAS = {
    "base": "Component ModelComponent Object Unknown",
    "constraints": "Constraint ConstraintSet",
    "contact": "ContactGeometry ContactGeometrySet ContactHalfSpace ContactMesh ContactSphere",
    "controllers": "Controller ControllerSet",
    "coordinates": "Coordinate",
    "forces": "CoordinateLimitForce Force ForceProducer ForceSet HuntCrossleyContactParameters "
    "HuntCrossleyContactParametersSet HuntCrossleyForce",
    "frames": "Body BodySet Frame Ground PhysicalFrame PhysicalOffsetFrame",
    "functions": "Constant Function",
    "geometry": "AnalyticGeometry Appearance Brick Cylinder Ellipsoid FrameGeometry Geometry Mesh ModelDisplayHints "
    "ModelVisualPreferences Sphere SurfaceProperties",
    "joints": "BallJoint FreeJoint GimbalJoint Joint JointSet PinJoint PlanarJoint SliderJoint UniversalJoint "
    "WeldJoint",
    "markers": "Marker MarkerSet Point Station",
    "model": "Model",
    "probes": "Probe ProbeSet",
    "sets": "ComponentSet ModelComponentSet ObjectGroup",
    "wrapping": "WrapObject WrapObjectSet",
}

_TAGS = {
    "HuntCrossleyForce::ContactParameters": "HuntCrossleyContactParameters",
    "HuntCrossleyForce::ContactParametersSet": "HuntCrossleyContactParametersSet",
}
"""Tags that are not the name of their class."""

MODULES = {name: f"osimlite.schema.{area}" for area, names in _AREAS.items() for name in names.split()}
"""The module of every class, by class name."""


@cache
def class_for(tag: str) -> type[Object] | None:
    """The class that an XML element `tag` stands for, or None if no class has it."""
    module = MODULES.get(_TAGS.get(tag, tag))
    if module is None:
        return None
    found = getattr(import_module(module), _TAGS.get(tag, tag))
    return None if found.abstract or found.tag != tag else found


def tags() -> list[str]:
    """Every tag that stands for a class in a file, sorted."""
    renamed = {name: tag for tag, name in _TAGS.items()}
    known = (renamed.get(name, name) for name in MODULES)
    return sorted(tag for tag in known if class_for(tag) is not None)
