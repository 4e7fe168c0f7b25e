"""What pushes the bodies of a model.

:mod:`gather <osimlite.simulation.elements.gather>` makes the force elements of a model. How a kind
of force is declared is told in :mod:`kind <osimlite.simulation.elements.force_type>`; the kinds are in
`kinds`, and where forces act in `geometries`.
"""

from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.gather import Forces, by_class, force_elements

__all__ = ["ElementBuilder", "Forces", "by_class", "force_elements"]
