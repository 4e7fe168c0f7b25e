"""Contact of half spaces, spheres and ellipsoids by Hunt and Crossley; a set of contacts makes its own items."""

from osimlite.simulation.elements.contact import HuntCrossley

KIND = HuntCrossley
