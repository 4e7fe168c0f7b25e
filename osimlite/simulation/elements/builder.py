"""Builder of the elements of one model: access to the model and its mechanism for declarations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from osimlite.base.text import suggest_or_list
from osimlite.errors import ModelError, SettingError, UnsupportedError
from osimlite.mechanics.multibody.functions import Function
from osimlite.mechanics.multibody.mechanism import FramePlacement, Mechanism
from osimlite.mechanics.multibody.schema_functions import convert_function
from osimlite.schema.base import Unknown
from osimlite.schema.forces import Force
from osimlite.schema.model import Model
from osimlite.simulation.elements.controls import Drive, ModelControls
from osimlite.simulation.elements.registry import FORCE_TYPES

if TYPE_CHECKING:
    from osimlite.io.meshes.folders import MeshFolders
    from osimlite.simulation.elements.force_records import ForceElement

C = TypeVar("C")
Triple = tuple[float, float, float]

WRAPPINGS = OPENSIM, GEODESIC = "opensim", "geodesic"
"""How paths may bend around surfaces."""


class ElementBuilder:
    """Makes the elements of one model.

    Attributes:
        tree: of the model.
        mechanism: of the model.
        reads_files: whether anything has asked for a file.
        drives: what controllers do, by their paths, of those that have been asked.
        early_return: whether Simbody's defect in contact is reproduced.
        own_times: whether OpenSim's defect in activation is not.
        geodesic: whether paths bend around surfaces along geodesics.
        rigid_tendons: whether muscles pull as if they had rigid tendons and no states.

    Raises:
        SettingError: there is no such wrapping.
    """

    def __init__(
        self,
        model: Model,
        mechanism: Mechanism,
        folder: Path,
        early_return: bool = False,
        own_times: bool = False,
        wrapping: str = OPENSIM,
        rigid_tendons: bool = False,
    ) -> None:
        if wrapping not in WRAPPINGS:
            raise SettingError(
                f"there is no wrapping '{wrapping}'{suggest_or_list(wrapping, WRAPPINGS)}"
            )
        self.model = model
        self.tree = model.tree()
        self.mechanism = mechanism
        self._folder, self.reads_files = folder, False
        self._of: dict[type, list[Any]] = {}
        self.drives: dict[str, list[Drive]] = {}
        self.early_return, self.own_times, self.geodesic = (
            early_return,
            own_times,
            wrapping == GEODESIC,
        )
        self.rigid_tendons = rigid_tendons

    @property
    def folder(self) -> Path:
        """Of the model's file: of what stands beside it."""
        self.reads_files = True
        return self._folder

    @property
    def mesh_folders(self) -> MeshFolders:
        """Where mesh files may be."""
        from osimlite.io.meshes.folders import MeshFolders

        return MeshFolders(self.folder)

    def components(self, component_class: type[C]) -> list[C]:
        """The components of a class, in the order of the model."""
        if component_class not in self._of:
            self._of[component_class] = [
                item for item in self.tree.components if isinstance(item, component_class)
            ]
        return self._of[component_class]

    def forces(self) -> Iterator[Any]:
        """Yield everything that applies a force, known or not, or has states that go with one."""
        for component in self.tree.components:
            unknown = (
                isinstance(component, Unknown)
                and self.tree.parent_of(component) is self.model.force_set
            )
            if unknown or (
                isinstance(component, Force)
                and (
                    component.appliesForce
                    or getattr(FORCE_TYPES.find(type(component)), "states", False)
                )
            ):
                yield component

    def element(self, force: Any) -> ForceElement:
        """The element of a force; UnsupportedError, with its path and class for a message, if there is none."""
        component: type = type(force)
        force_type = FORCE_TYPES.find(component)
        if force_type is None:
            raise self.unsupported(force)
        element: ForceElement = force_type.make(self, force)
        return element

    @cached_property
    def controls(self) -> ModelControls:
        """What the controllers of the model do."""
        return ModelControls(self)

    # ---------------------------------------------------------------------------------- what kinds ask for
    def coordinate(self, force: Any, field: str = "coordinate") -> int:
        """Place of the coordinate that a force names."""
        named = getattr(force, field)
        if not named:
            raise ModelError(f"the force '{self.path(force)}' names no coordinate; give it one")
        return self.mechanism.coordinate_index(self.path(self.target(force, field, named)))

    def target(self, holder: Any, field: str, value: Any) -> Any:
        """The component that a property refers to.

        Raises:
            ModelError: there is none.
        """
        if not value:
            raise ModelError(f"the '{field}' of '{self.path(holder)}' is empty; give it a name")
        result = self.tree.target(holder, field, value)
        if result is None:
            raise ModelError(
                f"the '{field}' of '{self.path(holder)}' names '{value}', which the model does not have; "
                "run 'osimlite validate'"
            )
        return result

    def placement(self, frame: Any) -> FramePlacement:
        """Body and place in it of a frame."""
        return self.mechanism.placement(self.path(frame))

    def function(self, force: Any, function: Any, what: str) -> Function:
        """A function of one number that belongs to a force.

        Raises:
            UnsupportedError: it is none that osimlite knows.
        """
        try:
            return convert_function(function, 1, f"'{what}' of '{self.path(force)}'")
        except UnsupportedError:
            raise self.unsupported(force, f" with the {kind_of(function)} '{what}'") from None

    def check(self, component: Any, numbers: Sequence[float]) -> None:
        """Raise a ModelError if a number is not finite."""
        # A sum is finite only of finite numbers; that of great ones may be infinite.
        if not (isfinite(sum(numbers)) or all(map(isfinite, numbers))):
            raise ModelError(
                f"'{self.path(component)}' has a parameter that is not a finite number; give one"
            )

    def unsupported(self, force: Any, why: str = "") -> UnsupportedError:
        """The error that names a force that cannot be computed."""
        return UnsupportedError(f"'{self.path(force)}' ({kind_of(force)}{why})")

    def path(self, component: Any) -> str:
        """Absolute path of a component."""
        path = self.tree.path_of(component)
        assert path is not None
        return path


def kind_of(component: Any) -> str:
    """Name of a component's class."""
    return getattr(component, "class_name", "") or type(component).__name__


def triple(values: Any) -> Triple:
    """Three numbers."""
    x, y, z = (float(value) for value in values)
    return x, y, z
