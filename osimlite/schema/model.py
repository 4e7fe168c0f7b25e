"""Model: the root of the component tree."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePath
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeVar, cast, overload

from osimlite.base.lazy import make_notebook_repr
from osimlite.base.text import add_article
from osimlite.errors import ModelError, OsimliteError
from osimlite.schema.base import Component, ModelComponent, Object, make_default
from osimlite.schema.contact import ContactGeometrySet
from osimlite.schema.facts import Facts
from osimlite.schema.fields import Single, Text, Unnamed, Vec3, real, vec3
from osimlite.schema.forces import ForceSet
from osimlite.schema.frames import BodySet, Ground
from osimlite.schema.geometry import ModelVisualPreferences
from osimlite.schema.joints import Joint, JointSet
from osimlite.schema.markers import MarkerSet
from osimlite.schema.sets import ComponentSet, ConstraintSet, ControllerSet, ProbeSet
from osimlite.schema.wrapping import WrapObjectSet

if TYPE_CHECKING:
    from osimlite.schema.tree import Tree

C = TypeVar("C", bound=Component)

CURRENT_VERSION = 40600
"""Document version that OpenSim 4.6 and osimlite write."""


class Model(ModelComponent):
    """A musculoskeletal or mechanical model."""

    facts = Facts(
        outputs="angular_momentum:Vec3 com_acceleration:Vec3 com_position:Vec3 com_velocity:Vec3 kinetic_energy "
        "linear_momentum:Vec3 momentum:SpatialVec potential_energy"
    )

    __slots__ = ("_tree",)

    is_root: ClassVar[bool] = True

    assembly_accuracy: Annotated[float, real(domain="> 0")] = 1e-9
    """Accuracy of constraints at the start of a simulation, which fails if it is not reached."""
    ground: Single[Ground] = make_default(
        Ground,
        name="ground",
        wrap_object_set=lambda: WrapObjectSet.build({"name": "wrapobjectset"}, set()),
    )
    """Inertial frame, the root of all bodies; gravity is given in it."""
    gravity: Annotated[Vec3, vec3("m/s^2")] = (0.0, -9.80665, 0.0)
    """Acceleration of free fall, along the axes of ground."""
    credits: Text = "Frank Anderson, Peter Loan, Ayman Habib, Ajay Seth, Michael Sherman"
    """Authors of the model, as text for readers."""
    publications: Text = "List of publications related to model..."
    """Publications to cite, as text for readers."""
    length_units: Text = "meters"
    """Unit of all lengths, in a word; tools convert marker data to it, the mechanics assume metres."""
    force_units: Text = "N"
    """Unit of all forces, in a word for readers; the mechanics assume newtons."""
    # In paths OpenSim calls each set by its class in lower case, whatever name the file gives it.
    body_set: Unnamed[BodySet] = make_default(BodySet, name="bodyset")
    """Rigid bodies, which joints connect."""
    joint_set: Unnamed[JointSet] = make_default(JointSet, name="jointset")
    """Joints; a body that is the child of none gets a free joint to ground."""
    controller_set: Unnamed[ControllerSet] = make_default(ControllerSet, name="controllerset")
    """Controllers, which set the controls of actuators."""
    constraint_set: Unnamed[ConstraintSet] = make_default(ConstraintSet, name="constraintset")
    """Conditions on positions beyond the joints, which close loops and couple coordinates."""
    force_set: Unnamed[ForceSet] = make_default(ForceSet, name="forceset")
    """All forces except gravity: forces, contact, actuators, muscles."""
    marker_set: Unnamed[MarkerSet] = make_default(MarkerSet, name="markerset")
    """Points whose positions motion capture measures."""
    contact_geometry_set: Unnamed[ContactGeometrySet] = make_default(
        ContactGeometrySet, name="contactgeometryset"
    )
    """Surfaces that contact forces name."""
    probe_set: Unnamed[ProbeSet] = make_default(ProbeSet, name="probeset")
    """Quantities that a simulation reports."""
    component_set: Unnamed[ComponentSet] = make_default(ComponentSet, name="componentset")
    """Components of any class that belong to no other set, such as reporters."""
    model_visual_preferences: Unnamed[ModelVisualPreferences] = make_default(
        ModelVisualPreferences, name="modelvisualpreferences"
    )
    """Preferences for the display of the model in viewers."""

    _repr_html_ = make_notebook_repr("model")

    @property
    def document_version(self) -> int:
        """Version of the document that the model was read from; the current one for a model made in Python."""
        version = self.layout.version if self.layout is not None else None
        return CURRENT_VERSION if version is None else version

    def tree(self) -> Tree:
        """Return the index of all components by path, rebuilt after changes of the model."""
        from osimlite.schema.tree import Tree

        tree = getattr(self, "_tree", None)
        if tree is None or not tree.is_current:
            tree = Tree(self) if tree is None else tree.renew()
            object.__setattr__(self, "_tree", tree)
        return cast("Tree", tree)

    def outdate(self, *, numbers_only: bool = False) -> None:
        """Mark the index as outdated before a change of the model.

        Args:
            numbers_only: whether paths and references stay the same.
        """
        tree = getattr(self, "_tree", None)
        if tree is not None:
            tree.outdate(numbers_only=numbers_only)

    @overload
    def components(self) -> Iterator[Component]: ...
    @overload
    def components(self, cls: type[C]) -> Iterator[C]: ...
    def components(self, cls: type[Component] = Component) -> Iterator[Component]:
        """Yield the components in OpenSim's order, parents first, starting with the model.

        Args:
            cls: class to which the result is restricted, with classes derived from it.

        Returns:
            An iterator over the components of the present tree.
        """
        return (component for component in self.tree().components if isinstance(component, cls))

    def __getitem__(self, path: str) -> Component:
        return self.find(path)

    def find(self, path: str) -> Component:
        """Return the component at a path, absolute or relative to the model.

        Raises:
            ModelError: the path does not exist; the message names the nearest one.
        """
        return self.tree().find(path)

    def rename(self, component: Component, name: str) -> None:
        """Rename a component, and update every reference to it or to components below it.

        Args:
            component: component of the model to rename.
            name: new name of the component.

        Raises:
            ModelError: the component is not in the model, the name is illegal, or a sibling has it.
        """
        from osimlite.schema.editing import rename_component

        rename_component(self, component, name)

    def remove(self, component: Component) -> None:
        """Remove a component and everything below it from the model.

        Raises:
            ModelError: the component is not in the model, is required, or other components name it.
        """
        from osimlite.schema.editing import remove_component

        remove_component(self, component)

    def add(self, *components: C) -> C:
        """Add components to the sets for their classes, in order, and return the first one.

        Returns:
            The first of the components.

        Raises:
            ModelError: no set of a model accepts the class, or a sibling has the name.
        """
        for component in components:
            for spec, holder in self.list_owned_objects():
                members = type(holder).field_specs().get("objects")
                if (
                    members is not None
                    # The set for components of any class comes last, for those that no other set accepts.
                    and spec.name != "component_set"
                    and isinstance(component, members.accepts)  # type: ignore[arg-type]
                ):
                    _append_member(cast("Any", holder).objects, component)
                    break
            else:
                if not isinstance(component, Object):
                    raise ModelError(
                        f"expected a component, found {add_article(type(component).__name__)}"
                    )
                if not isinstance(component, ModelComponent):
                    raise ModelError(
                        f"no set of a model accepts {add_article(type(component).__name__)}; add it to its owner, such as "
                        "a frame or a force"
                    )
                _append_member(self.component_set.objects, component)
            if isinstance(component, Joint) and "coordinates" not in component.model_fields_set:
                # OpenSim's API gives new joints such coordinate names, too. Reading a file that leaves the
                # coordinates out gives equal names in all joints instead.
                for number, coordinate in enumerate(component.coordinates):
                    if coordinate.name == f"_coord_{number}":
                        coordinate.name = f"{component.name}_coord_{number}"
            object.__setattr__(component, "_model", self)
        return components[0]


def check_is_model(value: object) -> None:
    """Check that a value is a model.

    Raises:
        OsimliteError: it is something else, most often the path of a file; the message says how to get
            a model.
    """
    if isinstance(value, Model):
        return
    if isinstance(value, str | PurePath):
        raise OsimliteError(
            f"expected a Model, found a path; read the file first: osimlite.read('{value}')"
        )
    raise OsimliteError(
        f"expected a Model, found {add_article(type(value).__name__)}; osimlite.read(path) returns a Model"
    )


def _append_member(members: list[Any], component: Component) -> None:
    for member in members:
        if member is component:
            raise ModelError(
                f"{type(component).__name__} '{component.name}' is in the model already"
            )
        if component.name and member.name == component.name:
            raise ModelError(
                f"there is {add_article(type(member).__name__)} '{component.name}' in the model already; "
                f"give this {type(component).__name__} another name"
            )
    members.append(component)
