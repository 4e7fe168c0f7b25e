"""A force between two points, by a control."""

from osimlite.schema.actuators import PointToPointActuator
from osimlite.simulation.elements.actuator import actuator
from osimlite.simulation.elements.geometries.body import POINTS

KIND = actuator(PointToPointActuator, POINTS, "force")
