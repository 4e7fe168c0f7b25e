"""A force at a point, and a torque, that are functions of time."""

from typing import Any

import numpy as np

from osimlite.mechanics.multibody.mechanism import GROUND, FramePlacement
from osimlite.schema.prescribed import PrescribedForce
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.geometries.load import GivenLoad, Load
from osimlite.simulation.elements.kind import Kind


class Prescribed(GivenLoad):
    """A frame, and functions; other than three functions count as none, as in OpenSim."""

    def read(self, builder: ElementBuilder, force: Any) -> Load:
        """The load of a force."""
        frame = builder.target(force, "socket_frame", force.socket_frame)
        placed, ground = builder.placement(frame), FramePlacement(GROUND, np.eye(4))
        given = []
        for what in ("forceFunctions", "pointFunctions", "torqueFunctions"):
            functions = getattr(force, what).objects
            given.append(
                tuple(
                    builder.function(force, item, what) for item in functions if len(functions) == 3
                )
            )
        start = f"{'ground' if force.forceIsGlobal else frame.name}_{force.name}"
        return Load(
            (f"{start}_f", f"{start}_p", f"{start}_torque_"),
            placed,
            ground if force.forceIsGlobal else placed,
            ground if force.pointIsGlobal else placed,
            *given,
        )


KIND = Kind(PrescribedForce, Prescribed())
