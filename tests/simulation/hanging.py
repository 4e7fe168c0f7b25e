"""A block that hangs on one actuator, along a slider that points down."""

from __future__ import annotations

from math import pi
from typing import Any

from osimlite import Body, Model, SliderJoint
from osimlite.schema.controller_types import PrescribedController
from osimlite.schema.functions import Constant
from osimlite.schema.paths import GeometryPath, PathPoint


def hanging(actuator: Any, control: float | None = 0.5) -> Model:
    """The length of the path is the coordinate x; the model of `motions.json.gz` with its muscles."""
    model = Model(name="hanging", gravity=(0.0, -9.80665, 0.0))
    block = model.add(Body(name="block", mass=20.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    slide = SliderJoint(name="slide")
    slide.coordinates[0].name, slide.coordinates[0].range = "x", (-10.0, 10.0)
    slide.coordinates[0].default_value = 0.33
    turned = (0.0, 0.0, -0.5 * pi)
    model.add(slide.between(model.ground, block, turned=turned, child_turned=turned))
    if "geometry_path" in type(actuator).model_fields:
        path = GeometryPath(name="path")
        for name, frame in (("a", "/ground"), ("b", "/bodyset/block")):
            path.path_point_set.objects.append(PathPoint(name=name, socket_parent_frame=frame))
        actuator.geometry_path = path
    model.add(actuator)
    if control is not None:
        controller = PrescribedController(name="c", socket_actuators=(f"/forceset/{actuator.name}",))
        controller.ControlFunctions.objects.append(Constant(value=control))
        model.add(controller)
    return model
