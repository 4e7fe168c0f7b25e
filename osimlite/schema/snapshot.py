"""A model as it is at one moment, for whoever may want to see it later."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from osimlite.schema.model import Model
    from osimlite.schema.tree import Tree


class Snapshot:
    """A model as it is now. It is copied when somebody asks for it, or just before it changes.

    Args:
        tree: of the model.
    """

    def __init__(self, tree: Tree) -> None:
        self._tree: Tree | None = tree
        self._copy: Model | None = None
        tree.snapshots.add(self)

    @property
    def model(self) -> Model:
        """A copy of the model as it was; always the same one."""
        if self._copy is None:
            assert self._tree is not None
            self._copy, self._tree = self._tree.model.copy_deep(), None
        return self._copy
