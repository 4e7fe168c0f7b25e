"""A measured force: a force at a point, and a torque, from the columns of a data file."""

from typing import Any

from osimlite.schema.prescribed import ExternalForce
from osimlite.simulation.elements.external_loads import load_in_model
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.geometries.load import GivenLoad, Load
from osimlite.simulation.elements.kind import Kind


class Measured(GivenLoad):
    """A force in a set of ExternalLoads that is part of the model."""

    def read(self, builder: ElementBuilder, force: Any) -> Load:
        """Its load."""
        return load_in_model(builder, force)


KIND = Kind(ExternalForce, Measured())
