"""The functions that are compiled by themselves, with those of forces and probes, by name.

The kernel of a kind of force is written from its declaration, and has the name of the module that declares it; so are
the one that brings such a force into equilibrium, with EQUILIBRIUM behind the name, that of a force that is off, with
OFF, the one that finds its derivatives, with RESPONSE, and that of a muscle whose tendon is taken for rigid, with
RIGID. Kernels of probes are written likewise.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from osimlite.kernels.table import LAW_MODULES, own_function

EQUILIBRIUM, OFF, RESPONSE, RIGID, ABREAST = "_equilibrium", "_off", "_response", "_rigid", "_abreast"
FORMS = {
    EQUILIBRIUM: "equilibrium_kernel", OFF: "off_kernel", RESPONSE: "response_kernel", RIGID: "rigid_kernel",
    ABREAST: "abreast_kernel",
}  # fmt: skip
ALONG = "~"
"""Between the name of a function and how many directions its numbers carry derivatives along."""


def law_of(name: str) -> tuple[Callable[..., Any], int]:
    """The function of a name, and how many directions its numbers carry derivatives along, 0 if they are floats."""
    name, _, directions = name.partition(ALONG)
    return law_function(name), int(directions or 0)


def law_function(name: str) -> Callable[..., Any]:
    """The function of a name."""
    function: Callable[..., Any]
    if name in LAW_MODULES:
        function = own_function(name)
    elif name.endswith("_probe"):
        function = import_module(f"{__package__}.probes.{name}").PROBE.kernel
    else:
        module = next((name.removesuffix(form) for form in FORMS if name.endswith(form)), name)
        kind = import_module(f"{__package__}.kinds.{module}").KIND
        function = getattr(kind.text, FORMS.get(name.removeprefix(module), "kernel"))
    return function
