"""The forces of a model, gathered as force elements."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from importlib import import_module
from importlib.util import find_spec
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from osimlite.base.load import module_name
from osimlite.base.records import dataclass
from osimlite.base.text import listed, or_known
from osimlite.errors import ModelError, SettingError, UnsupportedError
from osimlite.mechanics.multibody.functions import Function
from osimlite.mechanics.multibody.mechanism import FramePlacement, Mechanism
from osimlite.mechanics.multibody.schema_functions import numeric
from osimlite.schema.base import Unknown
from osimlite.schema.forces import Force
from osimlite.schema.model import Model
from osimlite.simulation.elements.controls import NO_CONTROLS, Controls, Drive, ModelControls

if TYPE_CHECKING:
    from osimlite.io.meshes.folders import MeshFolders
    from osimlite.schema.prescribed import ExternalLoads
    from osimlite.simulation.elements.items import ForceElement

C = TypeVar("C")
Triple = tuple[float, float, float]

WRAPPINGS = OPENSIM, GEODESIC = "opensim", "geodesic"
"""How paths may bend around surfaces."""


@dataclass(frozen=True)
class Forces:
    """The force elements of a model, then its probes; forces that were left out, as ``path (class)``; all controls.

    `reads_files` tells whether any of them is of more than the model: of a mesh, of measured loads
    or controls.
    """

    elements: tuple[ForceElement, ...]
    skipped: tuple[str, ...] = ()
    controls: Controls = NO_CONTROLS
    reads_files: bool = False


@np.errstate(over="ignore", divide="ignore", invalid="ignore")
def force_elements(
    model: Model,
    mechanism: Mechanism,
    *,
    skip_unsupported: bool = False,
    simbody_early_return: bool = False,
    own_activation_times: bool = False,
    wrapping: str = OPENSIM,
    external_loads: str | Path | ExternalLoads | None = None,
    folder: str | Path | None = None,
    rigid_tendons: bool = False,
) -> Forces:
    """Gather the forces of a model.

    Those whose `appliesForce` is false have nothing but their states, as in OpenSim.

    Args: model: whose forces. mechanism: of the same model. skip_unsupported: leave out what cannot
        be computed instead of raising. simbody_early_return: reproduce Simbody's defect in contact
        of several surfaces. own_activation_times: do not reproduce OpenSim's defect in the
        activation of several DeGrooteFregly2016Muscles. wrapping: how paths bend around surfaces,
        see :class:`osimlite.simulation.Options`. external_loads: measured loads or their file,
        which follow the forces of the model. folder: where the model's file is, and the files that
        it names; the folder that the program runs in if None. rigid_tendons: muscles pull with
        their control times the force of fully active fibers along a rigid tendon.

    Raises:
        UnsupportedError: some forces cannot be computed; the message names them.
        ModelError: a force names what does not exist, or a parameter has no meaning.
        OsimliteError: a file that is named cannot be read.
    """
    builder = ElementBuilder(
        model,
        mechanism,
        Path(folder or "."),
        simbody_early_return,
        own_activation_times,
        wrapping,
        rigid_tendons,
    )
    elements: list[ForceElement] = []
    skipped: list[str] = []
    for component in builder.forces():
        try:
            elements.append(builder.element(component))
        except UnsupportedError as error:
            skipped.append(error.message)
    if skipped and not skip_unsupported:
        raise UnsupportedError(
            f"osimlite cannot compute {listed(by_class(skipped))}; set appliesForce to false{SKIP_ADVICE}"
        )
    if external_loads is not None:
        from osimlite.simulation.elements.external_loads import read_external_loads

        elements += read_external_loads(mechanism, external_loads)
    from osimlite.simulation.elements.probe import probe_elements

    elements += probe_elements(builder, elements)
    controls, reads_files = (
        builder.controls.controls,
        builder.reads_files or external_loads is not None,
    )
    return Forces(tuple(elements), tuple(skipped), controls, reads_files)


SKIP_ADVICE = (
    ", or leave out what cannot be computed with --skip-unsupported (skip_unsupported=True)"
)
"""Advice for those commands that have this option; those that run setups have not, and take it out of the message."""
FEW = 4
"""So many forces that are left out are told of one by one."""


def by_class(skipped: Sequence[str]) -> list[str]:
    """What was left out for people: one by one if it is few, else how many of each class."""
    if len(skipped) <= FEW:
        return list(skipped)
    groups: dict[str, list[str]] = {}
    for words in skipped:
        path, _, kind = words.partition(" (")
        groups.setdefault(kind.removesuffix(")") or "others", []).append(path)
    return [f"{len(paths)} of {kind}: {listed(paths, most=2)}" for kind, paths in groups.items()]


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
            raise SettingError(f"there is no wrapping '{wrapping}'{or_known(wrapping, WRAPPINGS)}")
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

    def components(self, kind: type[C]) -> list[C]:
        """The components of a class, in the order of the model."""
        if kind not in self._of:
            self._of[kind] = [item for item in self.tree.components if isinstance(item, kind)]
        return self._of[kind]

    def forces(self) -> Iterator[Any]:
        """Yield everything that applies a force, known or not, or has states that go with one."""
        from osimlite.simulation.elements.kind import kind_of_class

        for component in self.tree.components:
            unknown = (
                isinstance(component, Unknown)
                and self.tree.parent_of(component) is self.model.force_set
            )
            if unknown or (
                isinstance(component, Force)
                and (
                    component.appliesForce
                    or getattr(kind_of_class(type(component)), "states", False)
                )
            ):
                yield component

    def element(self, force: Any) -> ForceElement:
        """The element of a force; UnsupportedError, with its path and class for a message, if there is none."""
        from osimlite.simulation.elements.kind import kind_of_class

        component: type = type(force)
        kind = kind_of_class(component)
        if kind is None:
            raise self.unsupported(force)
        return kind.make(self, force)

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
            return numeric(function, 1, f"'{what}' of '{self.path(force)}'")
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


def module_of(package: str, component: type) -> Any:
    """The module of the elements that declares what is made of a class; None if there is none."""
    name = f"{__package__}.{package}.{module_name(component.__name__)}"
    return import_module(name) if find_spec(name) is not None else None


def triple(values: Any) -> Triple:
    """Three numbers."""
    x, y, z = (float(value) for value in values)
    return x, y, z
