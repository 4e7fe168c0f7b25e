"""The forces of a model as engine-neutral force elements.

An element knows its bodies and coordinates by their place in the mechanism, and its constants in SI units. It can
write itself as code for a model (see :mod:`osimlite.simulation.field`) or be read as plain data by an engine with
compiled loops of its own; the law itself is in :mod:`osimlite.forces` in either case.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from osimlite.errors import ModelError, UnsupportedError
from osimlite.forces.coordinate_limit import limit_constants
from osimlite.multibody.functions import Function
from osimlite.multibody.mechanism import FramePlacement, Mechanism
from osimlite.multibody.schema_functions import numeric
from osimlite.schema.base import Unknown
from osimlite.schema.forces import CoordinateLimitForce, Force, HuntCrossleyForce
from osimlite.schema.model import Model
from osimlite.simulation.states import StateVariable
from osimlite.text import listed

if TYPE_CHECKING:
    from osimlite.meshes.folders import MeshFolders
    from osimlite.simulation.field import Writer

Triple = tuple[float, float, float]


class ForceElement(Protocol):
    """Anything that pushes bodies or coordinates."""

    @property
    def path(self) -> str:
        """Absolute path of the component."""

    @property
    def name(self) -> str:
        """Its name."""

    def write(self, writer: Writer) -> None:
        """Write the code that computes the force and adds it up."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Labels of what :meth:`record` gives, as OpenSim's ForceReporter has them."""

    def record(self, values: Sequence[Any], origins: Sequence[Triple]) -> list[float]:
        """One row of the columns.

        Args:
            values: what the code kept in the element's places at one state; None where nothing was kept.
            origins: origin of each body in ground, m; ground's own last.
        """


@dataclass(frozen=True)
class CoordinateLimit:
    """One CoordinateLimitForce.

    Attributes:
        constants: Ku, qu, Kl, ql, D, t of the law.
        states: the energy that the damper has taken up, if that is one.
    """

    path: str
    name: str
    coordinate: int
    constants: tuple[float, float, float, float, float, float]
    states: tuple[StateVariable, ...] = ()

    def write(self, writer: Writer) -> None:
        """Write the force on the coordinate."""
        q, u = writer.coordinate(self.coordinate)
        Ku, qu, Kl, ql, D, t = self.constants
        if isinstance(q, str):
            # The law is called beyond the limits only; where they are crossed (ql > qu), always.
            outside = f"if {q} > {qu!r} or {q} < {ql!r}:" if ql <= qu else "if True:"
            for state in self.states:
                writer.dissipate(state.path, 0.0)
            with writer.script.block(outside):
                for state in self.states:
                    writer.dissipate(state.path, writer.call("limit_dissipation", q, u, qu, ql, D, t))
                value = writer.call("limit_force", q, u, Ku, qu, Kl, ql, D, t)
                writer.push_coordinate(self.coordinate, value)
                self._keep(writer, value, q)
        elif writer.reporting:
            self._keep(writer, writer.call("limit_force", q, 0.0, Ku, qu, Kl, ql, D, t), q)

    def _keep(self, writer: Writer, value: str, q: float | str) -> None:
        if writer.reporting:
            Ku, qu, Kl, ql, _, t = self.constants
            writer.keep(0, value, writer.call("limit_energy", q, Ku, qu, Kl, ql, t))

    @property
    def columns(self) -> tuple[str, ...]:
        """The generalized force, and the energy."""
        return self.name, f"{self.name}.PotentialEnergy"

    def record(self, values: Sequence[Any], origins: Sequence[Triple]) -> list[float]:
        """Generalized force (N or N·m) and potential energy (J)."""
        (value,) = values
        return [0.0, 0.0] if value is None else [value[0], value[-1]]


@dataclass(frozen=True)
class Forces:
    """The force elements of a model in its order, and the forces that were left out, as ``path (class)``."""

    elements: tuple[ForceElement, ...]
    skipped: tuple[str, ...] = ()


def force_elements(
    model: Model,
    mechanism: Mechanism,
    *,
    skip_unsupported: bool = False,
    simbody_early_return: bool = False,
    external_loads: str | Path | None = None,
    folder: str | Path | None = None,
) -> Forces:
    """Gather the forces of a model.

    Forces whose `appliesForce` is false are no forces.

    Args:
        model: whose forces.
        mechanism: of the same model.
        skip_unsupported: leave out what cannot be computed instead of raising.
        simbody_early_return: reproduce Simbody's defect in contact of several surfaces.
        external_loads: a file of ExternalLoads, which follow the forces of the model.
        folder: where the model's file is, and the files that it names; the folder that the program runs in if None.

    Raises:
        UnsupportedError: some forces cannot be computed; the message names them.
        ModelError: a force names what does not exist, or a parameter has no meaning.
        OsimliteError: a file that is named cannot be read.
    """
    builder = ElementBuilder(model, mechanism, simbody_early_return, Path(folder or "."))
    elements: list[ForceElement] = []
    skipped: list[str] = []
    for component in builder.forces():
        try:
            elements.append(builder.element(component))
        except UnsupportedError as error:
            skipped.append(error.message)
    if skipped and not skip_unsupported:
        raise UnsupportedError(
            f"osimlite cannot compute {listed(by_class(skipped))}; switch off their appliesForce, "
            "or leave them out with --skip-unsupported (skip_unsupported=True); docs/forces.md says what is computed"
        )
    if external_loads is not None:
        from osimlite.simulation.external_loads import read_external_loads

        elements += read_external_loads(mechanism, external_loads)
    return Forces(tuple(elements), tuple(skipped))


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
        folder: of the model's file.
    """

    def __init__(self, model: Model, mechanism: Mechanism, early_return: bool, folder: Path) -> None:
        self.model = model
        self.tree = model.tree()
        self.mechanism = mechanism
        self.early_return = early_return
        self.folder = folder

    @property
    def mesh_folders(self) -> MeshFolders:
        """Where mesh files may be."""
        from osimlite.meshes.folders import MeshFolders

        return MeshFolders(self.folder)

    def forces(self) -> Iterator[Any]:
        """Yield everything that applies a force, known or not."""
        for component in self.tree.components:
            unknown = isinstance(component, Unknown) and self.tree.parent_of(component) is self.model.force_set
            if unknown or (isinstance(component, Force) and component.appliesForce):
                yield component

    def element(self, force: Any) -> ForceElement:
        """The element of a force; UnsupportedError, with its path and class for a message, if there is none."""
        if isinstance(force, CoordinateLimitForce):
            return self._coordinate_limit(force)
        if isinstance(force, HuntCrossleyForce):
            from osimlite.simulation.contact_elements import hunt_crossley

            return hunt_crossley(self, force)
        from osimlite.simulation.element_makers import MAKERS

        maker = MAKERS.get(type(force))
        if maker is None:
            raise self.unsupported(force)
        return maker(self, force)

    # ---------------------------------------------------------------------------------- what makers ask for
    def coordinate(self, force: Any) -> int:
        """Place of the coordinate that a force names."""
        if not force.coordinate:
            raise ModelError(f"the force '{self.path(force)}' names no coordinate; give it one")
        return self.mechanism.coordinate_index(self.path(self.target(force, "coordinate", force.coordinate)))

    def target(self, holder: Any, field: str, value: Any) -> Any:
        """The component that a property refers to.

        Raises:
            ModelError: there is none.
        """
        if not value:
            raise ModelError(f"the '{field}' of '{self.path(holder)}' is empty; give it a name")
        found = self.tree.target(holder, field, value)
        if found is None:
            raise ModelError(
                f"the '{field}' of '{self.path(holder)}' names '{value}', which the model does not have; "
                "run 'osimlite validate'"
            )
        return found

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

    def _coordinate_limit(self, force: CoordinateLimitForce) -> CoordinateLimit:
        coordinate = self.tree.target(force, "coordinate", force.coordinate)
        place = self.mechanism.coordinate_index(self.path(coordinate))
        constants = limit_constants(
            force.upper_stiffness,
            force.upper_limit,
            force.lower_stiffness,
            force.lower_limit,
            force.damping,
            force.transition,
            self.mechanism.coordinates[place].motion_type == "rotational",
        )
        self.check(force, constants)
        path = self.path(force)
        states = (StateVariable(f"{path}/dissipatedEnergy"),) if force.compute_dissipation_energy else ()
        return CoordinateLimit(path, force.name, place, constants, states)

    def check(self, component: Any, numbers: Sequence[float]) -> None:
        """Raise a ModelError if a number is not finite."""
        if not all(isfinite(number) for number in numbers):
            raise ModelError(f"'{self.path(component)}' has a parameter that is not a finite number; give one")

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
