"""Functions that are compiled separately, by name: those of the engine, of force types and of probes.

The kernel of a force type is generated from its declaration and has the name of the class in snake
case. A suffix distinguishes its other kernels: EQUILIBRIUM computes equilibrium states, OFF belongs
to a force that is off, RESPONSE computes derivatives, RIGID belongs to a muscle with a rigid
tendon, and BATCHED computes several forces together. Kernels of probes are generated in the same
way.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from osimlite.mechanics.kernels.table import LAW_MODULES, load_kernel
from osimlite.simulation.elements.registry import FORCE_TYPES, PROBE_TYPES

EQUILIBRIUM = "_equilibrium"
OFF = "_off"
RESPONSE = "_response"
RIGID = "_rigid"
BATCHED = "_batched"
FORMS = {
    EQUILIBRIUM: "equilibrium_kernel", OFF: "off_kernel", RESPONSE: "response_kernel", RIGID: "rigid_kernel",
    BATCHED: "batched_kernel",
}  # fmt: skip
"""Attribute of KernelText that has the kernel, by the suffix of its name."""
ALONG = "~"
"""Separates the name of a function from the number of directions of its derivatives."""

DIRECTIONS = 16
"""Number of directions of derivatives that the library of kernels is compiled for."""

WITHOUT_DERIVATIVES = frozenset(
    (
        # Complete motions are differentiated step by step; these integrators are not differentiated.
        "run_several", "hold_several", "walk_several", "run_by_reflexes", "euler2", "adams", "bdf", "rosenbrock",
        # Searches, and evaluations of many poses.
        "fit_frames", "least_effort", "evaluate_items", "evaluate_states", "push_each_actuator", "assemble_poses",
        # These compute initial states, which derivatives regard as constants.
        "equilibrate", "project",
        # Methods for stiff motions and pictures use these.
        "contact_response", "smooth_contact_response", "contact_places",
        *(name for name in LAW_MODULES if name.startswith("trace_")),
    )
)  # fmt: skip
"""Laws of the engine that the library contains for floats only, because nothing differentiates them."""


def list_library_laws(directions: int = 0) -> list[str]:
    """Return the names of all kernels of this package, as the library of kernels has them.

    Args:
        directions: number of directions of derivatives; 0 for floats.

    Returns:
        Names in a fixed order, on which the order of the machine code depends.
    """
    names = list(LAW_MODULES)
    for force_type in FORCE_TYPES:
        # Contacts in pairs use kernels of the engine.
        names += [force_type.name + form for form in getattr(force_type, "forms", ())]
    names += [probe.name for probe in PROBE_TYPES if probe.law is not None]
    if not directions:
        return names
    # Kernels of responses compute derivatives themselves; equilibrium is not differentiated.
    undifferentiated_forms = EQUILIBRIUM, RESPONSE, BATCHED
    return [
        f"{name}{ALONG}{directions}"
        for name in names
        if name not in WITHOUT_DERIVATIVES and not name.endswith(undifferentiated_forms)
    ]


def get_symbol(name: str) -> str:
    """Return the symbol of a kernel in compiled libraries, where ``~`` is not allowed.

    Args:
        name: name of the kernel.
    """
    return name.replace(ALONG, "_along_")


def find_law(name: str) -> tuple[Callable[..., Any], int]:
    """Return a law and the number of directions of its derivatives.

    Args:
        name: name of the function, with `ALONG` and the number of directions if it has derivatives.

    Returns:
        The function, and the number of directions; 0 for floats.
    """
    name, _, directions = name.partition(ALONG)
    return find_function(name), int(directions or 0)


def find_function(name: str) -> Callable[..., Any]:
    """Return the function of a law by its name without directions."""
    function: Callable[..., Any]
    if name in LAW_MODULES:
        function = load_kernel(name)
    elif (probe := PROBE_TYPES.find_kernel(name)) is not None:
        function = probe.kernel
    else:
        stem = next((name.removesuffix(form) for form in FORMS if name.endswith(form)), name)
        force_type = FORCE_TYPES.find_kernel(stem)
        function = getattr(force_type.text, FORMS.get(name.removeprefix(stem), "kernel"))
    return function
