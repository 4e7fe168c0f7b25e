"""OpenSim's ScaleTool: measure a generic model against a subject, scale it, place markers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from osimlite.base.records import dataclass, field
from osimlite.base.text import add_article, suggest_name
from osimlite.errors import DocumentError, SettingError
from osimlite.fitting.fit_messages import describe_unknown
from osimlite.fitting.ik_tool import NO_FILE, read_coordinate_table
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.marker_data import MarkerSource as Markers
from osimlite.fitting.measuring import ScaleFactorFinder, ScaleFactors, create_scale_set
from osimlite.fitting.placing import MarkerPlacement, format_pose, place_markers
from osimlite.fitting.scaling import scale_model
from osimlite.io.document.cache import read_copy
from osimlite.io.document.printer import to_text
from osimlite.io.tables.storage import expect_time_range
from osimlite.schema.base import Object
from osimlite.schema.frames import Body, PhysicalFrame
from osimlite.schema.markers import MarkerSet
from osimlite.schema.model import Model
from osimlite.schema.tools.ik_tasks import IKTask
from osimlite.schema.tools.scale import (
    BodyScale,
    BodyScaleSet,
    MarkerPair,
    MarkerPairSet,
    Measurement,
    Scale,
    ScaleTool,
)

MEASUREMENTS = "measurements"
"""Word of a `scaling_order` for factors from measurements."""
MANUAL_SCALE = "manualScale"
"""Word of a `scaling_order` for prescribed factors."""
MeasurementPairs = Mapping[str, tuple[Sequence[tuple[str, str]], Mapping[str, str]]]
"""Pairs of markers and the axes that they scale by body (``"XYZ"``), by name of the measurement."""


@dataclass(eq=False)
class ScaledModel:
    """Scaled model, with its factors and files.

    Attributes:
        model: scaled model.
        measured: scale factors of the bodies, and their origin.
        placed: new positions of the markers; None if they were not placed.
        texts: texts of the files that the tool writes, by path from the folder of the setup.
        unknown: message about parts of unknown classes, which keep their size; "" without any.
        masses: total mass before and after scaling, kg; None if the model was not scaled.
    """

    model: Model
    measured: ScaleFactors | None = None
    placed: MarkerPlacement | None = None
    texts: dict[str, str] = field(default_factory=dict)
    unknown: str = ""
    masses: tuple[float, float] | None = None

    def describe_mass(self) -> str:
        """Return a text about the change of the mass; "" if the model was not scaled."""
        if self.masses is None:
            return ""
        before, after = self.masses
        text = f"scaled from {before:.5g} to {after:.5g} kg"
        # Typical mistakes are grams, pounds and a missing digit.
        is_plausible = before / LARGEST_MASS_RATIO <= after <= before * LARGEST_MASS_RATIO
        return text if is_plausible else f"{text}; is the mass of the subject in kg?"


LARGEST_MASS_RATIO = 4.0
"""Larger ratios of the masses of subject and model are probably an error of the unit."""


UNSCALED = "Such parts are not scaled, and keep the size of the generic model"
"""Consequence for parts of unknown classes."""


def scale(
    model: Model,
    static: Markers | None = None,
    *,
    measurements: MeasurementPairs | Iterable[Measurement] = (),
    factors: Mapping[str, float | Sequence[float]] | None = None,
    mass: float = -1.0,
    preserve_mass_distribution: bool = False,
    place: bool = False,
    tasks: Iterable[IKTask] = (),
    start: float = float("-inf"),
    end: float = float("inf"),
) -> ScaledModel:
    """Scale a model to a subject, as OpenSim's ScaleTool does.

    Args:
        model: generic model with markers named as those of the data; it is not changed.
        static: measured markers of the standing subject: a file, or arrays by name.
        measurements: by name of the measurement: its pairs of markers, whose mean ratio of
            distances is the factor, and the axes that this factor scales, by body:
            ``{"thigh": ([("RASI", "RKNE")], {"femur_r": "XYZ"})}``; or OpenSim's objects. Later
            measurements overwrite earlier ones.
        factors: one factor for each body, or one for each axis; they overwrite measurements.
        mass: mass of the subject, kg; if it is not positive, the mass follows from the factors.
        preserve_mass_distribution: whether the bodies keep their shares of the mass.
        place: whether to fit the pose to the standing subject, and move the markers to their
            measured positions.
        tasks: weights and targets of that pose; by default all markers with equal weight.
        start: start of the range over which markers are averaged, s.
        end: end of the range, s.

    Returns:
        The scaled model with its factors.

    Raises:
        SettingError: a name is unknown, a factor is not positive, or measured markers are missing.
    """
    copy = model.copy_deep()
    measuring = ScaleFactorFinder(copy)

    def expect_body(name: str) -> None:
        if name not in measuring.frames:
            raise SettingError(
                f"'{model.name}' has no body '{name}'{suggest_name(name, measuring.frames)}"
            )

    if isinstance(measurements, Mapping):
        measurements = _create_measurements(measurements)
        for body in (
            body for measurement in measurements for body in measurement.body_scale_set.objects
        ):
            expect_body(body.name)
    # Factors by hand need no measured markers.
    data = None if static is None else MarkerData.from_source(static)
    measurement_list = list(measurements)
    if (measurement_list or place) and data is None:
        raise SettingError(
            "measurements and placement need markers of the standing subject; name a static trial"
        )
    if data is not None and measurement_list:
        measuring.apply_measurements(measurement_list, data, start, end)
    by_hand = []
    for name, body_factors in (factors or {}).items():
        expect_body(name)
        # One number scales all axes alike.
        axis_factors = (
            (body_factors, body_factors, body_factors)
            if isinstance(body_factors, int | float)
            else tuple(body_factors)
        )
        if not all(0.0 < number < math.inf for number in axis_factors):
            numbers = ", ".join(f"{number:g}" for number in axis_factors)
            raise SettingError(f"expected positive factors of '{name}', found {numbers}")
        by_hand.append(Scale(segment=name, scales=tuple(map(float, axis_factors))))
    measuring.apply_factors(by_hand)
    results = measuring.result
    mechanism = measuring.mechanism
    scale_model(
        copy,
        results.factors,
        mass,
        preserve_mass_distribution=preserve_mass_distribution,
        mechanism=mechanism,
    )
    result = ScaledModel(
        copy,
        measuring.result,
        unknown=describe_unknown(model, UNSCALED),
        masses=(_sum_masses(model), _sum_masses(copy)),
    )
    if place and data is not None:
        result.placed = place_markers(copy, data, tasks, start, end)
    return result


def _sum_masses(model: Model) -> float:
    return sum(body.mass for body in model.components(Body))


def _create_measurements(pairs: MeasurementPairs) -> list[Measurement]:
    """Return OpenSim's objects for measurements.

    Raises:
        SettingError: a measurement has no axes for each body, or other axes than X, Y and Z.
    """
    for name, (_, scaled_bodies) in pairs.items():
        if not isinstance(scaled_bodies, Mapping):
            raise SettingError(
                f"measurement '{name}' must have pairs of markers, and for each body the axes to "
                "scale"
            )
        for body, axes in scaled_bodies.items():
            if not axes or not {*axes.lower()} <= {*"xyz"}:
                raise SettingError(
                    f"'{axes}' of '{body}' are not axes; write one or more of the letters X, Y and Z"
                )
    return [
        Measurement(
            name=name,
            marker_pair_set=MarkerPairSet(
                objects=[MarkerPair(markers=tuple(pair)) for pair in markers]
            ),
            body_scale_set=BodyScaleSet(
                objects=[
                    BodyScale(name=body, axes=tuple(axes)) for body, axes in scaled_bodies.items()
                ]
            ),
        )
        for name, (markers, scaled_bodies) in pairs.items()
    ]


def compute_scaled_model(tool: ScaleTool, folder: Path) -> ScaledModel:
    """Return the scaled model and the files that a ScaleTool computes; write nothing.

    Args:
        tool: setup of the tool.
        folder: folder of the setup, from which its paths start.

    Raises:
        SettingError: the setup has an unknown name or lacks a file.
        DocumentError: a file cannot be read.
    """
    model_maker = tool.generic_model_maker
    scaler = tool.model_scaler
    placer = tool.marker_placer
    if model_maker.model_file in NO_FILE:
        raise SettingError("the setup names no model; set model_file of GenericModelMaker")
    result = ScaledModel(read_copy(folder / model_maker.model_file, Model))
    model = result.model
    if scaler.apply:
        result.unknown = describe_unknown(model, UNSCALED)
    if model_maker.marker_set_file not in NO_FILE:
        add_markers(model, folder / model_maker.marker_set_file)
    # OpenSim names the scaled model after the setup, before markers are placed.
    model.name = tool.name
    if scaler.apply:
        mass_before = _sum_masses(model)
        result.measured = _scale_by_setup(tool, model, folder)
        result.masses = (mass_before, _sum_masses(model))
        frames = [frame.name for frame in model.components(PhysicalFrame)]
        _add_text(result, scaler.output_model_file, model)
        _add_text(result, scaler.output_scale_file, create_scale_set(frames, result.measured))
    if placer.apply and placer.marker_file not in NO_FILE:
        data = MarkerData.from_source(folder / placer.marker_file)
        coordinates = read_coordinate_table(placer.coordinate_file, folder)
        start, end = expect_time_range(placer.time_range)
        result.placed = place_markers(
            model, data, placer.ik_task_set.objects, start, end, coordinates
        )
        _add_text(result, placer.output_model_file, model)
        _add_text(result, placer.output_marker_file, model.marker_set)
        if placer.output_motion_file not in NO_FILE:
            result.texts[placer.output_motion_file] = format_pose(model, result.placed)
    return result


def _scale_by_setup(tool: ScaleTool, model: Model, folder: Path) -> ScaleFactors:
    """Scale a model by the measurements and factors of a setup.

    Returns:
        Scale factors of the bodies, and their origin.

    Raises:
        SettingError: measurements need a marker file that the setup does not name, or its
            `scaling_order` has an unknown word.
    """
    scaler = tool.model_scaler
    measuring = ScaleFactorFinder(model)
    # Later words overwrite earlier ones, so that their order matters.
    for step in scaler.scaling_order:
        if step == MEASUREMENTS and any(
            measurement.apply for measurement in scaler.measurement_set.objects
        ):
            if scaler.marker_file in NO_FILE:
                raise SettingError(
                    "scaling by measurements needs a marker_file of ModelScaler; set it"
                )
            data = MarkerData.from_source(folder / scaler.marker_file)
            measuring.apply_measurements(
                scaler.measurement_set.objects, data, *expect_time_range(scaler.time_range)
            )
        elif step == MANUAL_SCALE:
            measuring.apply_factors(scaler.scale_set.objects)
        elif step != MEASUREMENTS:
            suggestion = suggest_name(step, (MEASUREMENTS, MANUAL_SCALE))
            raise SettingError(
                f"scaling_order has '{step}'; expected {MEASUREMENTS} or {MANUAL_SCALE}{suggestion}"
            )
    keeps_distribution = scaler.preserve_mass_distribution
    result = measuring.result
    mechanism = measuring.mechanism
    scale_model(
        model,
        result.factors,
        tool.mass,
        preserve_mass_distribution=keeps_distribution,
        mechanism=mechanism,
    )
    return result


def add_markers(model: Model, path: Path) -> None:
    """Add the markers of a file to a model; they replace markers of the same name.

    Args:
        model: model that gets the markers.
        path: file of a MarkerSet.

    Raises:
        DocumentError: the file has no MarkerSet.
    """
    result = read_copy(path, Object)
    if not isinstance(result, MarkerSet):
        raise DocumentError(
            f"the file holds {add_article(type(result).__name__)}, not a MarkerSet", file=str(path)
        )
    for marker in result.objects:
        # A copy of the list, because markers are removed from it.
        for replaced in [
            existing for existing in model.marker_set.objects if existing.name == marker.name
        ]:
            model.marker_set.objects.remove(replaced)
        model.marker_set.objects.append(marker.copy_deep())


def _add_text(result: ScaledModel, name: str, document: Object) -> None:
    """Add the text of a document, unless its file has no name."""
    if name not in NO_FILE:
        result.texts[name] = to_text(document, numbers="opensim")
