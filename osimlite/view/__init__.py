"""Pictures of models and motions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from osimlite.base.lazy import make_lazy_getattr

if TYPE_CHECKING:
    from osimlite.view.animation import animate as animate
    from osimlite.view.model_view import ModelView as ModelView
    from osimlite.view.page import Story as Story
    from osimlite.view.plots import plot_simulation as plot_simulation

__getattr__ = make_lazy_getattr(
    __name__,
    {
        "ModelView": "osimlite.view.model_view",
        "Story": "osimlite.view.page",
        "animate": "osimlite.view.animation",
        "plot_simulation": "osimlite.view.plots",
    },
    deprecated={"Shown": "ModelView"},
)
