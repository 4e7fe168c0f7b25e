"""Models, data and comparisons for the tests of derivatives."""

from __future__ import annotations

from functools import cache

import osimlite
from osimlite.models.jumper import jumper


@cache
def human():
    return osimlite.modify(jumper(), paths="polynomial")


def pendulum(gravity=9.81):
    model = osimlite.Model(name="pendulum", gravity=(0.0, -gravity, 0.0))
    rod = model.add(
        osimlite.Body(
            name="rod", mass=2.0, mass_center=(0.1, -0.5, 0.0), inertia=(0.2, 0.1, 0.2, 0, 0, 0)
        )
    )
    angle = osimlite.Coordinate(name="angle", default_value=0.7)
    model.add(osimlite.PinJoint(name="hinge", coordinates=[angle]).between(model.ground, rod))
    model.add(osimlite.CoordinateActuator(name="motor", coordinate="angle", optimal_force=3.0))
    return model
