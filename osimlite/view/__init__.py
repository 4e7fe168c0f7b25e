"""Pictures of models and motions."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

from osimlite.base.lazy import make_lazy_getattr
from osimlite.errors import DeprecatedWarning

if TYPE_CHECKING:
    from osimlite.view.animation import animate as animate
    from osimlite.view.model_view import ModelView as ModelView
    from osimlite.view.page import Story as Story
    from osimlite.view.plots import plot_simulation as plot_simulation

_import_name = make_lazy_getattr(
    __name__,
    {
        "ModelView": "osimlite.view.model_view",
        "Story": "osimlite.view.page",
        "animate": "osimlite.view.animation",
        "plot_simulation": "osimlite.view.plots",
    },
)


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used; warn if it is the deprecated name ``Shown``.

    Returns:
        The function or class of that name.
    """
    if name != "Shown":
        return _import_name(name)
    warnings.warn(
        "osimlite.view.Shown is deprecated; use osimlite.view.ModelView",
        DeprecatedWarning,
        stacklevel=2,
    )
    return _import_name("ModelView")
