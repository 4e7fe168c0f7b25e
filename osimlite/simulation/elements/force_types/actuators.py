"""Actuators that apply their control, scaled by an optimal force, to a coordinate, a body, points or a path."""

from osimlite.mechanics.laws.springs import mckibben_tension
from osimlite.schema.actuators import (
    ActivationCoordinateActuator,
    BodyActuator,
    CoordinateActuator,
    PointActuator,
    PointToPointActuator,
    TorqueActuator,
)
from osimlite.schema.muscles import McKibbenActuator, PathActuator
from osimlite.simulation.elements.force_type import ForceType, State
from osimlite.simulation.elements.geometries.body import AXIS, BODY, POINT, POINTS
from osimlite.simulation.elements.geometries.coordinate import COORDINATE
from osimlite.simulation.elements.geometries.geometry import Geometry
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.elements.parameters import Number, positive
from osimlite.simulation.elements.registry import register_force_type


def scale_control(control: float, optimal_force: float) -> float:
    """The control times the optimal force."""
    return optimal_force * control


def define_actuator(component: type, geometry: Geometry, output: str) -> ForceType:
    """The kind of an define_actuator whose control times its optimal force is what the geometry applies."""
    return ForceType(
        component,
        geometry,
        scale_control,
        inputs=(),
        outputs=(output,),
        parameters=("optimal_force",),
        controlled=True,
        labels={"{name}": output},
    )


register_force_type(define_actuator(CoordinateActuator, COORDINATE, "force"))


def scale_activation(
    control: float, activation: float, optimal_force: float, time: float
) -> tuple[float, float]:
    """The activation times the optimal force, and its rate: what it lacks of the control over a time constant (s)."""
    return optimal_force * activation, (control - activation) / time


register_force_type(
    ForceType(
        ActivationCoordinateActuator,
        COORDINATE,
        scale_activation,
        inputs=(),
        outputs=("force", "activation_rate"),
        parameters=("optimal_force", positive("activation_time_constant")),
        controlled=True,
        states=(State("activation"),),
        labels={"{name}": "force"},
        goes_on=True,
    )
)


register_force_type(define_actuator(TorqueActuator, AXIS, "torque"))


register_force_type(define_actuator(PointActuator, POINT, "force"))


register_force_type(define_actuator(PointToPointActuator, POINTS, "force"))


def return_wrench(
    tx: float, ty: float, tz: float, fx: float, fy: float, fz: float
) -> tuple[float, float, float, float, float, float]:
    """The controls: torque (N.m) and force (N)."""
    return tx, ty, tz, fx, fy, fz


register_force_type(
    ForceType(
        BodyActuator,
        BODY,
        return_wrench,
        outputs=("tx", "ty", "tz", "fx", "fy", "fz"),
        controlled=True,
        labels={},
    )
)


register_force_type(define_actuator(PathActuator, PATH, "tension"))


register_force_type(
    ForceType(
        McKibbenActuator,
        PATH,
        mckibben_tension,
        inputs=("length",),
        outputs=("tension",),
        parameters=(
            Number("number_of_turns", lambda value: value != 0.0, "is 0; give it some"),
            "thread_length",
            "cord_length",
        ),
        controlled=True,
        labels={"{name}": "tension"},
    )
)
