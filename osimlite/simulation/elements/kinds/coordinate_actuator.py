"""A generalized force on a coordinate, by a control."""

from osimlite.schema.actuators import CoordinateActuator
from osimlite.simulation.elements.actuator import actuator
from osimlite.simulation.elements.geometries.coordinate import COORDINATE

KIND = actuator(CoordinateActuator, COORDINATE, "force")
