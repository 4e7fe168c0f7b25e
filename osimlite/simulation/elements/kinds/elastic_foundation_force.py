"""Contact of meshes by an elastic foundation; a set of contacts makes its own items."""

from osimlite.simulation.elements.foundation import ElasticFoundation

KIND = ElasticFoundation
