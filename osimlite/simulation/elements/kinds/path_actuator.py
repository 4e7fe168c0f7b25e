"""A tension along a path, by a control."""

from osimlite.schema.path_actuators import PathActuator
from osimlite.simulation.elements.actuator import actuator
from osimlite.simulation.elements.geometries.path import PATH

KIND = actuator(PathActuator, PATH, "tension")
