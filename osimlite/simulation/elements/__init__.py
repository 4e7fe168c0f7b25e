"""Force elements: everything that applies forces to a mechanism, and what controls and probes them.

:mod:`gather <osimlite.simulation.elements.gather>` collects the elements of a model.
:mod:`registry <osimlite.simulation.elements.registry>` names the module that declares each class.
:mod:`force_type <osimlite.simulation.elements.force_type>` says what a declaration has;
`force_types` contains the declarations, and `geometries` where forces act.
"""

from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.gather import Forces, force_elements, summarize_skipped

__all__ = ["ElementBuilder", "Forces", "force_elements", "summarize_skipped"]
