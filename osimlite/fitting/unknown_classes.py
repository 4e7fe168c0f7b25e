"""Messages about parts of a model whose classes osimlite does not know, such as those of plug-ins."""

from __future__ import annotations

from osimlite.base.text import counted, listed
from osimlite.schema.base import Unknown
from osimlite.schema.model import Model

IGNORED = "without effect on the fit"
"""What becomes of parts of unknown classes where a motion is fitted to markers."""
MOST_NAMED = 3
"""Parts that a message names one by one."""


def find_unknown(model: Model) -> list[str]:
    """Return the parts of a model whose classes are unknown, each as ``path (class)``.

    Args:
        model: which is searched, with all that its components hold.
    """
    tree = model.tree()
    parts = [part for part in model.walk() if isinstance(part, Unknown)]
    return [f"{tree.path_of(part) or part.name or 'a part'} ({part.class_name})" for part in parts]


def describe_unknown(model: Model, consequence: str) -> str:
    """Return a sentence that names the components of unknown classes, or "" without such components.

    Args:
        model: that was read.
        consequence: what became of them, as in "not scaled".
    """
    parts = find_unknown(model)
    if not parts:
        return ""
    return (
        f"{consequence}: {counted(len(parts), 'part')} of classes that osimlite does not know, "
        f"{listed(parts, most=MOST_NAMED)}; OpenSim refuses the model unless the plug-in of these classes is loaded"
    )
