"""The functions that are compiled by themselves, with those of forces and probes, by name.

The kernel of a kind of force is written from its declaration, and has the name of the module that
declares it; so are the one that brings such a force into equilibrium, with EQUILIBRIUM behind the
name, that of a force that is off, with OFF, the one that finds its derivatives, with RESPONSE, and
that of a muscle whose tendon is taken for rigid, with RIGID. Kernels of probes are written
likewise.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from osimlite.mechanics.kernels.table import LAW_MODULES, own_function
from osimlite.simulation.elements.registry import FORCE_TYPES, PROBE_TYPES

EQUILIBRIUM, OFF, RESPONSE, RIGID, ABREAST = (
    "_equilibrium",
    "_off",
    "_response",
    "_rigid",
    "_abreast",
)
FORMS = {
    EQUILIBRIUM: "equilibrium_kernel", OFF: "off_kernel", RESPONSE: "response_kernel", RIGID: "rigid_kernel",
    ABREAST: "abreast_kernel",
}  # fmt: skip
ALONG = "~"
"""Between the name of a function and how many directions its numbers carry derivatives along."""

DIRECTIONS = 16
"""Number of directions of the derivatives that the library of kernels is compiled for."""

WITHOUT_DERIVATIVES = frozenset(
    (
        # Whole motions, which are followed step by step, and methods that no derivatives are
        # followed along.
        "run_several", "hold_several", "walk_several", "run_by_reflexes", "euler2", "adams", "bdf", "rosenbrock",
        # Searches, and looks at many poses.
        "fit_frames", "least_effort", "watch", "look", "push_each", "assemble_poses",
        # What finds a start, which is held.
        "equilibrate", "project",
        # What methods for stiff motions ask, and pictures.
        "contact_response", "smooth_contact_response", "contact_places",
        *(name for name in LAW_MODULES if name.startswith("trace_")),
    )
)  # fmt: skip
"""Laws of the engine that nobody needs derivatives from: the library has them for floats only."""


def library_laws(directions: int = 0) -> list[str]:
    """Return the names of all laws of this package, in a fixed order, as the library of kernels has them.

    Args:
        directions: of the derivatives that their numbers carry; 0 for floats.
    """
    names = list(LAW_MODULES)
    for force_type in FORCE_TYPES:
        # Contacts in pairs have kernels of the engine.
        names += [force_type.name + form for form in getattr(force_type, "forms", ())]
    names += [probe.name for probe in PROBE_TYPES if probe.law is not None]
    if not directions:
        return names
    # The kernels of responses have derivatives of their own within; nothing is brought into
    # equilibrium on the way.
    without = EQUILIBRIUM, RESPONSE, ABREAST
    return [
        f"{name}{ALONG}{directions}"
        for name in names
        if name not in WITHOUT_DERIVATIVES and not name.endswith(without)
    ]


def symbol_of(name: str) -> str:
    """Return the symbol of a law in compiled libraries."""
    return name.replace(ALONG, "_along_")


def law_of(name: str) -> tuple[Callable[..., Any], int]:
    """The function of a name, and how many directions its numbers carry derivatives along, 0 if they are floats."""
    name, _, directions = name.partition(ALONG)
    return law_function(name), int(directions or 0)


def law_function(name: str) -> Callable[..., Any]:
    """The function of a name."""
    function: Callable[..., Any]
    if name in LAW_MODULES:
        function = own_function(name)
    elif (probe := PROBE_TYPES.find_kernel(name)) is not None:
        function = probe.kernel
    else:
        stem = next((name.removesuffix(form) for form in FORMS if name.endswith(form)), name)
        force_type = FORCE_TYPES.find_kernel(stem)
        function = getattr(force_type.text, FORMS.get(name.removeprefix(stem), "kernel"))
    return function
