"""Scale tool: scaling of a generic model to the size and mass of a subject."""

from typing import Annotated

from osimlite.schema.base import Object, make_default, make_empty_list
from osimlite.schema.fields import (
    LegacyFlag,
    LegacyMany,
    LegacyText,
    LegacyUnnamed,
    Reals,
    Reference,
    Value,
    real,
    reals,
)
from osimlite.schema.references import (
    LegacyInputMarkers,
    LegacyInputModel,
    LegacyInputTable,
    LegacyOutputModel,
    LegacyOutputTable,
    Named,
    Names,
    make_input_file,
    make_output_file,
)
from osimlite.schema.sets import Set
from osimlite.schema.tools.ik_tasks import IKTaskSet

LegacyTimeRange = Annotated[Reals, reals("s", least=2, most=2, legacy=True)]


class GenericModelMaker(Object):
    """Reads the model that is scaled."""

    model_file: LegacyInputModel = "Unassigned"
    """File of the model, relative to the folder of the setup file."""
    marker_set_file: Annotated[str, make_input_file("MarkerSet", legacy=True)] = "Unassigned"
    """Markers that are added to those of the model, or replace those of the same name."""


class MarkerPair(Object):
    """Two markers whose distance is measured."""

    # OpenSim crashes if a pair has one marker. It skips the measurement, with factor 1, if one of
    # the two is unknown or missing in a single frame.
    markers: Annotated[
        Names, Reference("marker-name", "Marker", "list", legacy=True, consequence="left out")
    ] = ()
    """Names of the two markers, of the model and of the data."""


class MarkerPairSet(Set):
    """The pairs of markers of a measurement."""

    objects: LegacyMany[MarkerPair] = make_empty_list()
    """The pairs; the measurement is the mean of their ratios."""


class BodyScale(Object):
    """Axes of the body with the same name that a measurement scales."""

    # OpenSim ignores the entry of an unknown body silently.
    name_reference = Reference("body-name", "Body", consequence="left out")

    # XY without a blank is one unknown word, and the body keeps its size.
    axes: Annotated[tuple[str, ...], Value("string", "list", legacy=True)] = ()
    """Axes of the body along which it is scaled: X, Y, Z; other words have no effect."""


class BodyScaleSet(Set):
    """The bodies that a measurement scales."""

    objects: LegacyMany[BodyScale] = make_empty_list()
    """The bodies with their axes."""


class Measurement(Object):
    """Length of the subject by which bodies are scaled."""

    apply: LegacyFlag = True
    """Whether the measurement is used."""
    marker_pair_set: LegacyUnnamed[MarkerPairSet] = make_default(MarkerPairSet)
    """Pairs of markers whose distances are compared, measured to model."""
    body_scale_set: LegacyUnnamed[BodyScaleSet] = make_default(BodyScaleSet)
    """Bodies and axes that are scaled by the ratio."""


class MeasurementSet(Set):
    """The measurements of a subject."""

    objects: LegacyMany[Measurement] = make_empty_list()
    """Measurements; of two that scale the same axis, the last one wins."""


class Scale(Object):
    """Scale factors of a body."""

    scales: Annotated[Reals, reals(least=3, most=3, legacy=True)] = (1.0, 1.0, 1.0)
    """Factors along the x, y and z axes of the body."""
    segment: Annotated[
        Named, Reference("body-name", "PhysicalFrame", legacy=True, consequence="left out")
    ] = "unnamed_segment"
    """Name of the body."""
    apply: LegacyFlag = True
    """Whether the factors are used."""


class ScaleSet(Set):
    """Prescribed scale factors."""

    objects: LegacyMany[Scale] = make_empty_list()
    """The factors, body by body."""


class ModelScaler(Object):
    """Scales the bodies, by measurements or by prescribed factors."""

    apply: LegacyFlag = True
    """Whether the model is scaled."""
    # OpenSim compares the words with their case, and the tool fails with any other word.
    scaling_order: Annotated[tuple[str, ...], Value("string", "list", legacy=True)] = ()
    """Sources of scale factors in turn: measurements, manualScale; the last one wins."""
    measurement_set: LegacyUnnamed[MeasurementSet] = make_default(MeasurementSet)
    """Lengths that are taken from the data."""
    scale_set: LegacyUnnamed[ScaleSet] = make_default(ScaleSet)
    """Prescribed factors."""
    # OpenSim believes the units of the header: m for mm scales by 1000, silently.
    marker_file: LegacyInputMarkers = "Unassigned"
    """Measured markers of a standing subject (.trc)."""
    # Outside of the data OpenSim takes the nearest frame, silently.
    time_range: LegacyTimeRange = (-1.0, -1.0)
    """First and last time over which distances are averaged."""
    # In both cases OpenSim then multiplies all masses and inertias so that the sum is the mass of
    # the subject, if that is positive.
    preserve_mass_distribution: LegacyFlag = False
    """Whether the bodies keep their shares of the mass; otherwise their masses grow with their sizes."""
    output_model_file: LegacyOutputModel = "Unassigned"
    """File for the scaled model."""
    output_scale_file: Annotated[str, make_output_file("ScaleSet", legacy=True)] = "Unassigned"
    """File for the factors."""


# OpenSim poses the model with a fixed accuracy of 1e-4. In OpenSim's own example it places markers
# up to 9.5 mm from where the best pose puts them.
class MarkerPlacer(Object):
    """Poses the scaled model like the subject, and moves markers to their measured positions."""

    # If this is false, OpenSim reports that the tool failed, after it has written the scaled model.
    apply: LegacyFlag = True
    """Whether markers are moved."""
    ik_task_set: LegacyUnnamed[IKTaskSet] = make_default(IKTaskSet)
    """Tasks to which the pose is fitted."""
    marker_file: LegacyInputMarkers = "Unassigned"
    """Measured markers of a standing subject (.trc)."""
    coordinate_file: LegacyInputTable = ""
    """Values of coordinates for tasks that take them from a file."""
    # OpenSim rejects its own default here: the placer needs two times in ascending order.
    time_range: LegacyTimeRange = (-1.0, -1.0)
    """First and last time over which the markers are averaged."""
    output_motion_file: LegacyOutputTable = "Unassigned"
    """File for the pose."""
    output_model_file: LegacyOutputModel = "Unassigned"
    """File for the model with its markers moved."""
    output_marker_file: Annotated[str, make_output_file("MarkerSet", legacy=True)] = "Unassigned"
    """File for the moved markers."""
    max_marker_movement: Annotated[float, real("m", legacy=True)] = -1.0
    """Largest movement of a marker, negative for any distance; the placer ignores it."""


class ScaleTool(Object):
    """Scales a generic model to a subject and places its markers."""

    # OpenSim does not mention that it leaves the masses alone where this is not positive or NaN.
    mass: Annotated[float, real("kg", legacy=True)] = -1.0
    """Mass of the subject; if not positive, the masses are those of the scaled bodies."""
    height: Annotated[float, real("mm", legacy=True)] = -1.0
    """Height of the subject, for readers only."""
    age: Annotated[float, real("years", legacy=True)] = -1.0
    """Age of the subject, for readers only."""
    notes: LegacyText = "Unassigned"
    """Notes on the subject, for readers only."""
    generic_model_maker: LegacyUnnamed[GenericModelMaker] = make_default(GenericModelMaker)
    """First step, which reads the model."""
    model_scaler: LegacyUnnamed[ModelScaler] = make_default(ModelScaler)
    """Second step, which scales the bodies."""
    marker_placer: LegacyUnnamed[MarkerPlacer] = make_default(MarkerPlacer)
    """Third step, which places the markers."""
