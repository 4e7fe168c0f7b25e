"""Sets of components, and the bases of constraints, controllers and probes with their sets."""

from typing import TYPE_CHECKING, Annotated, Any

from osimlite.schema.base import ModelComponent, Object, make_empty_list
from osimlite.schema.facts import Facts
from osimlite.schema.fields import Flag, LegacyMany, Number, Reals, reals, word
from osimlite.schema.references import ActuatorSockets, SetMemberNames

if TYPE_CHECKING:
    Member = Any  # each set says which: a list of bodies is not a list of objects
else:
    Member = Object


class ObjectGroup(Object):
    """A named selection of the members of the set it belongs to."""

    members: SetMemberNames = ()
    """Names of the members of the selection."""


class Set(Object, abstract=True):
    """Objects of one kind, each with its own name."""

    objects: LegacyMany[Member] = make_empty_list()
    """Members of the set, in order."""
    groups: LegacyMany[ObjectGroup] = make_empty_list()
    """Named selections of the members; the mechanics ignore them, and so do the tools."""


class ModelComponentSet(Set, ModelComponent, abstract=True):
    """Set with a path in the component tree, which is always its class name in lower case."""


class ComponentSet(ModelComponentSet):
    """Further components of a model."""

    objects: LegacyMany[ModelComponent] = make_empty_list()
    """Components of any class that belong to no other set, such as reporters."""


class Constraint(ModelComponent, abstract=True):
    """Condition that the motion fulfils."""

    isEnforced: Flag = True
    """Whether the constraint is active during a simulation."""


class ConstraintSet(ModelComponentSet):
    """The constraints of a model."""

    objects: LegacyMany[Constraint] = make_empty_list()
    """Constraints; those that are not enforced have no effect."""


class Controller(ModelComponent, abstract=True):
    """Computes the controls of the actuators it names."""

    # OpenSim rejects a model in which a controller names an actuator twice.
    socket_actuators: ActuatorSockets = ()
    """Actuators that are controlled; the controls of several controllers are added."""
    enabled: Flag = True
    """Whether the controller adds anything to the controls."""


class ControllerSet(ModelComponentSet):
    """The controllers of a model."""

    objects: LegacyMany[Controller] = make_empty_list()
    """Controllers; their controls of one actuator are added."""


class Probe(ModelComponent, abstract=True):
    """Quantity along a simulation, possibly integrated or differentiated, times `gain`."""

    facts = Facts(outputs="probe_outputs:Vector")

    enabled: Flag = True
    """Whether the probe is computed and reported."""
    probe_operation: Annotated[
        str, word("value", "integrate", "differentiate", "minimum", "minabs", "maximum", "maxabs")
    ] = "value"
    """Operation on the quantity: its value, integral, rate, or extreme so far."""
    # OpenSim replaces a wrong number of values by zeros, with an error in its log only.
    initial_conditions_for_integration: Annotated[Reals, reals()] = ()
    """Initial values of the integrals, one number for each quantity of the probe."""
    gain: Number = 1.0
    """Factor of the reported quantity."""


class ProbeSet(ModelComponentSet):
    """The probes of a model."""

    objects: LegacyMany[Probe] = make_empty_list()
    """The probes; tools write their values to a file."""
