"""A force at a point of a body, by a control."""

from osimlite.schema.actuators import PointActuator
from osimlite.simulation.elements.actuator import actuator
from osimlite.simulation.elements.geometries.body import POINT

KIND = actuator(PointActuator, POINT, "force")
