"""What actuators that push by their control alone have in common."""

from __future__ import annotations

from osimlite.simulation.elements.geometries.geometry import Geometry
from osimlite.simulation.elements.kind import Kind


def effort(control: float, optimal_force: float) -> float:
    """The control times the optimal force."""
    return optimal_force * control


def actuator(component: type, geometry: Geometry, output: str) -> Kind:
    """The kind of an actuator whose control times its optimal force is what the geometry applies."""
    return Kind(
        component,
        geometry,
        effort,
        inputs=(),
        outputs=(output,),
        parameters=("optimal_force",),
        controlled=True,
        labels={"{name}": output},
    )
