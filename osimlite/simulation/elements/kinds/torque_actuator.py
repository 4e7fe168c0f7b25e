"""A torque between two bodies, by a control."""

from osimlite.schema.actuators import TorqueActuator
from osimlite.simulation.elements.actuator import actuator
from osimlite.simulation.elements.geometries.body import AXIS

KIND = actuator(TorqueActuator, AXIS, "torque")
