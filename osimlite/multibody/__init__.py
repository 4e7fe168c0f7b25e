"""From model to mechanism: a tree of bodies and mobilizers, its kinematics and dynamics in numpy."""

from __future__ import annotations

from typing import TYPE_CHECKING

from osimlite._require import require

require("numpy", extra="sim", purpose="a mechanism")

from osimlite.multibody.build import build_mechanism  # noqa: E402
from osimlite.multibody.dynamics import Wrench  # noqa: E402
from osimlite.multibody.mechanism import Mechanism  # noqa: E402

if TYPE_CHECKING:
    from osimlite.schema.model import Model

__all__ = ["Mechanism", "Wrench", "build_mechanism", "mechanism"]


# The submodule of this name is imported above, so that no later import puts it in the place of the function.
def mechanism(model: Model) -> Mechanism:
    """The mechanism that a model describes; see :func:`osimlite.multibody.build.build_mechanism`."""
    return build_mechanism(model)
