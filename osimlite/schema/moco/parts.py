"""Parts of the goals, constraints and problems of Moco: bounds, weights, parameters."""

from typing import Annotated

from osimlite.schema.base import Component, Object, make_default, make_empty_list
from osimlite.schema.fields import (
    LegacyMany,
    Many,
    NamesOf,
    Number,
    Reals,
    Reference,
    Single,
    Text,
    Unnamed,
    Value,
    reals,
)
from osimlite.schema.references import Names
from osimlite.schema.sets import Set

Bounds = Annotated[Reals, reals(most=2)]
Strings = Annotated[tuple[str, ...], Value("string", "list")]
OfStates = NamesOf(Reference("state-path", "state variable"))
MaybeOfStates = NamesOf(Reference("state-path", "state variable", required=False))
OfControls = NamesOf(Reference("state-path", "control"))
OfFrames = NamesOf(Reference("model-path", "Frame", consequence="left out"))
OfMarkers = NamesOf(Reference("marker-name", "Marker", required=False, consequence="left out"))
OfOutputs = NamesOf(Reference("state-path", "output"))
OfForces = NamesOf(Reference("state-path", "generalized force"))
PatternOfStates = NamesOf(Reference("pattern", "state variable", consequence="left out"))
PatternOfControls = NamesOf(Reference("pattern", "control", consequence="left out"))
PatternOfForces = NamesOf(Reference("pattern", "generalized force", consequence="left out"))
StatePattern = Annotated[str | None, Value("string", "optional"), PatternOfStates]


class MocoBounds(Object):
    """Smallest and largest value of a variable."""

    bounds: Bounds = ()
    """Both ends of the range; one number for a fixed variable, none for a free one."""


class MocoInitialBounds(MocoBounds):
    """Bounds of a variable at the start."""


class MocoFinalBounds(MocoBounds):
    """Bounds of a variable at the end."""


class MocoWeight(Object):
    """Weight of the state, control, marker, frame or other item with the same name."""

    weight: Number = 1.0
    """Value of the weight, relative to the others."""


class MocoWeightSet(Set):
    """Weights by name."""

    objects: LegacyMany[MocoWeight] = make_empty_list()
    """Weights; items without one have weight 1."""


StateWeights = Annotated[Single[MocoWeightSet], OfStates]
ControlWeights = Annotated[Single[MocoWeightSet], OfControls]
FrameWeights = Annotated[Single[MocoWeightSet], OfFrames]
MarkerWeights = Annotated[Single[MocoWeightSet], OfMarkers]


class MocoConstraintInfo(Object):
    """Bounds of the equations of a constraint; OpenSim writes it and does not read it again."""

    bounds: Many[MocoBounds] = make_empty_list()
    """Bounds of each equation; left out, they are zero."""
    suffixes: Strings = ()
    """Suffixes that distinguish the equations in names."""


class MocoScaleFactor(Component):
    """A factor that an optimization finds for a goal."""

    bounds: Bounds = ()
    """Range of the factor in the optimization."""
    scale_factor: Number = 1.0
    """The factor itself, which the optimization sets."""


class MocoVariableInfo(Object):
    """Bounds of a state or a control; the name is its path."""

    name_reference = Reference("state-path", "state or control variable", required=False)

    bounds: Bounds = ()
    """Range over the complete phase."""
    initial_bounds: Bounds = ()
    """The range at the start."""
    final_bounds: Bounds = ()
    """The range at the end."""


class MocoParameter(Object):
    """A property of the model that an optimization finds."""

    moco_bounds: Unnamed[MocoBounds] = make_default(MocoBounds)
    """Range of the value in the optimization."""
    component_paths: Annotated[Names, Reference("model-path", "Component", "list")] = ()
    """Paths of the components that all get the value."""
    property_name: Text = ""
    """Name of the property of those components."""
    property_element: Annotated[int | None, Value("int", "optional")] = None
    """Index of the number in the property, from 0; left out for a property of one number."""
