"""Builder of the elements of one model: what declarations read from the model and its mechanism."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from osimlite.base.text import suggest_or_list
from osimlite.errors import ModelError, SettingError, UnsupportedError
from osimlite.mechanics.multibody.functions import SmoothFunction
from osimlite.mechanics.multibody.mechanism import FramePlacement, Mechanism
from osimlite.mechanics.multibody.schema_functions import convert_function
from osimlite.schema.base import Unknown
from osimlite.schema.forces import Force
from osimlite.schema.model import Model
from osimlite.schema.resolution import is_a
from osimlite.simulation.elements.controls import Drive, ModelControls
from osimlite.simulation.elements.registry import FORCE_TYPES

if TYPE_CHECKING:
    from osimlite.io.meshes.folders import MeshFolders
    from osimlite.schema.forces import Actuator
    from osimlite.simulation.elements.force_records import ForceElement

C = TypeVar("C")
Triple = tuple[float, float, float]

WRAPPINGS = OPENSIM, GEODESIC = "opensim", "geodesic"
"""Methods by which paths bend around surfaces."""


class ElementBuilder:
    """Builder of the force elements of one model.

    Args:
        model: model whose elements are built.
        mechanism: mechanism of the model.
        folder: folder of the model's file.
        early_return: whether to reproduce Simbody's defect in contact of several surfaces.
        own_activation_times: whether each muscle uses its own activation times; OpenSim's defect
            shares those of one muscle.
        wrapping: "opensim" or "geodesic".
        rigid_tendons: whether muscles are computed with rigid tendons and without states.

    Attributes:
        model: model whose elements are built.
        tree: component tree of the model.
        mechanism: mechanism of the model.
        reads_files: whether an element has used a file.
        drives: drives of the controllers that were read so far, by the paths of the controllers.
        early_return: whether to reproduce Simbody's defect in contact of several surfaces.
        own_activation_times: whether each muscle uses its own activation times; OpenSim's defect
            shares those of one muscle.
        geodesic: whether paths bend around surfaces along geodesics.
        rigid_tendons: whether muscles are computed with rigid tendons and without states.

    Raises:
        SettingError: the wrapping is unknown.
    """

    def __init__(
        self,
        model: Model,
        mechanism: Mechanism,
        folder: Path,
        early_return: bool = False,
        own_activation_times: bool = False,
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
        self.early_return = early_return
        self.own_activation_times = own_activation_times
        self.geodesic = wrapping == GEODESIC
        self.rigid_tendons = rigid_tendons

    @property
    def folder(self) -> Path:
        """Folder of the model's file, in which other files are found."""
        # Results then depend on files, and may not be cached by the model alone.
        self.reads_files = True
        return self._folder

    @property
    def mesh_folders(self) -> MeshFolders:
        """Folders that may contain mesh files."""
        from osimlite.io.meshes.folders import MeshFolders

        return MeshFolders(self.folder)

    def find_components(self, component_class: type[C]) -> list[C]:
        """Return the components of a class, in the order of the model."""
        if component_class not in self._of:
            self._of[component_class] = [
                item for item in self.tree.components if isinstance(item, component_class)
            ]
        return self._of[component_class]

    def list_actuators(self) -> list[Actuator]:
        """Return the actuators, in the order of the model."""
        # The name of the class saves models without actuators its import.
        actuators: list[Any] = [item for item in self.tree.components if is_a(item, "Actuator")]
        return actuators

    def iterate_forces(self) -> Iterator[Any]:
        """Yield every component that applies a force or has the states of one.

        Components of unknown classes in the ForceSet are included, so that they are reported.
        """
        for component in self.tree.components:
            unknown = (
                # Unknown classes get an error, not silence.
                # An unknown class in the force set may be a force: it gets an error, not silence.
                isinstance(component, Unknown)
                and self.tree.parent_of(component) is self.model.force_set
            )
            if unknown or (
                isinstance(component, Force)
                and (
                    component.appliesForce
                    # A muscle that is switched off keeps its states in OpenSim.
                    or getattr(FORCE_TYPES.find(type(component)), "states", False)
                )
            ):
                yield component

    def make_element(self, force: Any) -> ForceElement:
        """Return the element of a force.

        Args:
            force: force component of the model.

        Raises:
            UnsupportedError: osimlite cannot compute it; the message is its path and class.
        """
        component: type = type(force)
        force_type = FORCE_TYPES.find(component)
        if force_type is None:
            raise self.make_unsupported_error(force)
        element: ForceElement = force_type.make(self, force)
        return element

    @cached_property
    def controls(self) -> ModelControls:
        """Controls that the controllers of the model set."""
        return ModelControls(self)

    # -------------------------------------------------------------------------- access for declarations
    def find_coordinate(self, force: Any, field: str = "coordinate") -> int:
        """Return the index in the mechanism of the coordinate that a force names.

        Args:
            force: force component of the model.
            field: property that names the coordinate.

        Raises:
            ModelError: the property is empty, or the mechanism has no coordinate of this name.
        """
        named = getattr(force, field)
        if not named:
            raise ModelError(
                f"the force '{self.path(force)}' names no coordinate; set its '{field}'"
            )
        return self.mechanism.coordinate_index(self.path(self.resolve_target(force, field, named)))

    def resolve_target(self, holder: Any, field: str, value: Any) -> Any:
        """Return the component that a property refers to.

        Args:
            holder: component with the property.
            field: name of the property.
            value: value of the property, a path or a component.

        Raises:
            ModelError: the property is empty, or there is no such component.
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

    def find_placement(self, frame: Any) -> FramePlacement:
        """Return the body of a frame and the frame's placement in it."""
        return self.mechanism.placement(self.path(frame))

    def read_function(self, force: Any, function: Any, what: str) -> SmoothFunction:
        """Return a function of one argument that belongs to a force.

        Args:
            force: force component of the model.
            function: function object of the schema.
            what: name of the property, for messages.

        Raises:
            UnsupportedError: osimlite does not know the class of the function.
        """
        try:
            return convert_function(function, 1, f"'{what}' of '{self.path(force)}'")
        except UnsupportedError:
            raise self.make_unsupported_error(
                force, f" with the {get_class_name(function)} '{what}'"
            ) from None

    def check_finite(self, component: Any, numbers: Sequence[float]) -> None:
        """Check that the parameters of a component are finite.

        Args:
            component: the component.
            numbers: the parameters.

        Raises:
            ModelError: a number is not finite.
        """
        # A finite sum proves that all numbers are finite; the sum of large ones may overflow.
        if not (isfinite(sum(numbers)) or all(map(isfinite, numbers))):
            raise ModelError(
                f"'{self.path(component)}' has a parameter that is not a finite number; give it a finite value"
            )

    def make_unsupported_error(self, force: Any, why: str = "") -> UnsupportedError:
        """Return the error that names a force that cannot be computed.

        Args:
            force: force component of the model.
            why: continuation of the message after the class.
        """
        return UnsupportedError(f"'{self.path(force)}' ({get_class_name(force)}{why})")

    def path(self, component: Any) -> str:
        """Return the absolute path of a component."""
        path = self.tree.path_of(component)
        assert path is not None
        return path


def get_class_name(component: Any) -> str:
    """Return the name of a component's class, as the file has it."""
    return getattr(component, "class_name", "") or type(component).__name__


def to_triple(values: Any) -> Triple:
    """Return three values as a tuple of floats."""
    x, y, z = (float(value) for value in values)
    return x, y, z
