"""The compiled engine: accelerations, steps and events in machine code.

What is compiled are the functions of :mod:`osimlite.mechanics.kernels` with the force laws and the
step control that they call. The code serves every model: models and parameters are arrays.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from osimlite.errors import OsimliteError, SimulationError
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.model import Model
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.gather import OPENSIM
from osimlite.simulation.engines import many
from osimlite.simulation.engines.base import KernelEngine
from osimlite.simulation.engines.linking import version
from osimlite.simulation.engines.protocol import Settings
from osimlite.simulation.many import BatchEngine

if TYPE_CHECKING:
    from osimlite.simulation.engines.renewal import NumbersOnly


def make(mechanism: Mechanism, forces: Forces, settings: Settings) -> BatchEngine:
    """Make the engine."""
    if settings.show:
        raise SimulationError(
            "the compiled engine shows no window; osimlite view plays its motions, or take --engine bullet for --gui"
        )
    if settings.route not in ("auto", CompiledEngine.route):
        raise OsimliteError(
            f"the compiled engine has no route '{settings.route}'; there is {CompiledEngine.route}, and others of "
            "engine 'bullet'"
        )
    return CompiledEngine(mechanism, forces)


class CompiledEngine(KernelEngine):
    """The accelerations of a mechanism in machine code; see the protocol for what it offers.

    Args:
        mechanism: what moves.
        forces: what pushes it, besides gravity.

    Raises:
        UnsupportedError: a joint, a function, a constraint or a force that it does not know.
    """

    name = "compiled"
    version = version()
    route = "composite-rigid-body"

    def __reduce__(self) -> Any:
        # Addresses mean nothing in another process.
        return CompiledEngine, (self.mechanism, self.forces)

    run_many, contact_places, contact_radii = many.run_many, many.contact_places, many.contact_radii

    def renewal(self, model: Model, folder: Path, wrapping: str = OPENSIM) -> NumbersOnly:
        """What makes parts of the model anew."""
        from osimlite.simulation.engines.renewal import NumbersOnly

        return NumbersOnly(model, self, folder, wrapping)
