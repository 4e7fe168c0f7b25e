"""OpenSim's ScaleTool: a generic model measured against a subject, scaled, and its markers placed."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from osimlite.base.records import dataclass, field
from osimlite.base.text import suggest_name
from osimlite.errors import DocumentError, SettingError
from osimlite.fitting.fit_messages import describe_unknown
from osimlite.fitting.ik_tool import UNNAMED, coordinate_table
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.marker_data import Measured as Markers
from osimlite.fitting.measuring import Measured, Measuring, scale_set
from osimlite.fitting.placing import Placed, place_markers, pose_text
from osimlite.fitting.scaling import scale_model
from osimlite.io.document.cache import read_anew
from osimlite.io.document.printer import to_text
from osimlite.io.document.reader import read_any
from osimlite.io.tables.storage import both_of
from osimlite.schema.base import Object
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.markers import MarkerSet
from osimlite.schema.model import Model
from osimlite.schema.tools.inverse_kinematics import IKTask
from osimlite.schema.tools.scale import (
    BodyScale,
    BodyScaleSet,
    MarkerPair,
    MarkerPairSet,
    Measurement,
    Scale,
    ScaleTool,
)

MEASUREMENTS, BY_HAND = "measurements", "manualScale"
"""What a `scaling_order` may consist of."""
Pairs = Mapping[str, tuple[Sequence[tuple[str, str]], Mapping[str, str]]]
"""Measurements by name: pairs of markers, and by body the axes that they scale (``"XYZ"``)."""


@dataclass(eq=False)
class Scaled:
    """A scaled model.

    Attributes: model: the model. measured: factors of the bodies, and what they come from. placed:
        where the markers went, if they were placed. texts: names, from the folder of the setup
        file, and texts of the files that the tool writes. unknown: what is said of parts of unknown
        classes, which keep their size; "" if there are none.
    """

    model: Model
    measured: Measured | None = None
    placed: Placed | None = None
    texts: dict[str, str] = field(default_factory=dict)
    unknown: str = ""


UNSCALED = "not scaled, but left in the size of the generic model"
"""What becomes of parts of unknown classes."""


def scale(
    model: Model,
    static: Markers | None = None,
    *,
    measurements: Pairs | Iterable[Measurement] = (),
    factors: Mapping[str, float | Sequence[float]] | None = None,
    mass: float = -1.0,
    preserve_mass_distribution: bool = False,
    place: bool = False,
    tasks: Iterable[IKTask] = (),
    start: float = float("-inf"),
    end: float = float("inf"),
) -> Scaled:
    """Scale a model to a subject, as OpenSim's ScaleTool does; the model itself stays as it is.

    Args: model: the generic model, with markers named as those of the data. static: measured
        markers of the standing subject: a file, or arrays by name. measurements: by name pairs of
        markers, and by body the axes that the mean ratio of their distances scales, as ``{"thigh":
        ([("RASI", "RKNE")], {"femur_r": "XYZ"})}``; or OpenSim's objects. Later ones overwrite.
        factors: of bodies, one or one for each axis; they overwrite what is measured. mass: what
        the subject weighs, kg; if it is not positive that follows from the factors.
        preserve_mass_distribution: let the bodies keep their shares of the mass. place: whether to
        pose the scaled model as the subject stood and move its markers to the measured places.
        tasks: what that pose is fitted to; by default all markers, which weigh the same. start:
        time from which markers are averaged, s. end: time up to which, s.

    Raises: SettingError: something names what is not there, a factor is not positive, or markers
        are needed and not given.
    """
    copy = model.copy_deep()
    measuring = Measuring(copy)

    def expect_body(name: str) -> None:
        if name not in measuring.frames:
            raise SettingError(
                f"'{model.name}' has no body '{name}'{suggest_name(name, measuring.frames)}"
            )

    if isinstance(measurements, Mapping):
        measurements = _measurements(measurements)
        for body in (body for item in measurements for body in item.body_scale_set.objects):
            expect_body(body.name)
    data = None if static is None else MarkerData.of(static)
    wanted = list(measurements)
    if (wanted or place) and data is None:
        raise SettingError(
            "the subject is to be measured, and there are no markers of it; give them"
        )
    if data is not None and wanted:
        measuring.by_measurements(wanted, data, start, end)
    by_hand = []
    for name, given in (factors or {}).items():
        expect_body(name)
        three = (given, given, given) if isinstance(given, int | float) else tuple(given)
        if not all(0.0 < number < math.inf for number in three):
            numbers = ", ".join(f"{number:g}" for number in three)
            raise SettingError(f"factors of '{name}' are positive numbers, not {numbers}")
        by_hand.append(Scale(segment=name, scales=tuple(map(float, three))))
    measuring.by_hand(by_hand)
    results, mechanism = measuring.found, measuring.mechanism
    scale_model(
        copy,
        results.factors,
        mass,
        preserve_mass_distribution=preserve_mass_distribution,
        mechanism=mechanism,
    )
    result = Scaled(copy, measuring.found, unknown=describe_unknown(model, UNSCALED))
    if place and data is not None:
        result.placed = place_markers(copy, data, tasks, start, end)
    return result


def _measurements(pairs: Pairs) -> list[Measurement]:
    for name, (_, on) in pairs.items():
        if not isinstance(on, Mapping):
            raise SettingError(
                f"measurement '{name}' is pairs of markers, and by body the axes that they scale"
            )
        for body, axes in on.items():
            if not axes or not {*axes.lower()} <= {*"xyz"}:
                raise SettingError(f"'{axes}' of '{body}' are no axes; write some of XYZ")
    return [
        Measurement(
            name=name,
            marker_pair_set=MarkerPairSet(
                objects=[MarkerPair(markers=tuple(pair)) for pair in markers]
            ),
            body_scale_set=BodyScaleSet(
                objects=[BodyScale(name=body, axes=tuple(axes)) for body, axes in on.items()]
            ),
        )
        for name, (markers, on) in pairs.items()
    ]


def run_scale(tool: ScaleTool, folder: Path) -> Scaled:
    """What the tool computes from the files that its setup names; nothing is written.

    Args:
        tool: the setup.
        folder: that of the setup file, from which its paths go.

    Raises:
        SettingError: it asks for what is not there.
        DocumentError: a file cannot be read.
    """
    maker, scaler, placer = tool.generic_model_maker, tool.model_scaler, tool.marker_placer
    if maker.model_file in UNNAMED:
        raise SettingError(
            "the setup names no model; put its file into model_file of GenericModelMaker"
        )
    result = Scaled(read_anew(folder / maker.model_file, Model))
    model = result.model
    if scaler.apply:
        result.unknown = describe_unknown(model, UNSCALED)
    if maker.marker_set_file not in UNNAMED:
        add_markers(model, folder / maker.marker_set_file)
    model.name = tool.name
    if scaler.apply:
        result.measured = _scaled(tool, model, folder)
        frames = [frame.name for frame in model.components(PhysicalFrame)]
        _put(result, scaler.output_model_file, model)
        _put(result, scaler.output_scale_file, scale_set(frames, result.measured))
    if placer.apply and placer.marker_file not in UNNAMED:
        data = MarkerData.of(folder / placer.marker_file)
        coordinates = coordinate_table(placer.coordinate_file, folder)
        first, last = both_of(placer.time_range)
        result.placed = place_markers(
            model, data, placer.ik_task_set.objects, first, last, coordinates
        )
        _put(result, placer.output_model_file, model)
        _put(result, placer.output_marker_file, model.marker_set)
        if placer.output_motion_file not in UNNAMED:
            result.texts[placer.output_motion_file] = pose_text(model, result.placed)
    return result


def _scaled(tool: ScaleTool, model: Model, folder: Path) -> Measured:
    """Scale the model by what the tool measures and is given."""
    scaler, measuring = tool.model_scaler, Measuring(model)
    for word in scaler.scaling_order:
        if word == MEASUREMENTS and any(item.apply for item in scaler.measurement_set.objects):
            if scaler.marker_file in UNNAMED:
                raise SettingError(
                    "the model is scaled by measurements, and ModelScaler has no marker_file; name one"
                )
            data = MarkerData.of(folder / scaler.marker_file)
            measuring.by_measurements(
                scaler.measurement_set.objects, data, *both_of(scaler.time_range)
            )
        elif word == BY_HAND:
            measuring.by_hand(scaler.scale_set.objects)
        elif word != MEASUREMENTS:
            near = suggest_name(word, (MEASUREMENTS, BY_HAND))
            raise SettingError(
                f"scaling_order has '{word}'; it consists of {MEASUREMENTS} and {BY_HAND}{near}"
            )
    keeps = scaler.preserve_mass_distribution
    result, mechanism = measuring.found, measuring.mechanism
    scale_model(
        model, result.factors, tool.mass, preserve_mass_distribution=keeps, mechanism=mechanism
    )
    return result


def add_markers(model: Model, path: Path) -> None:
    """Add the markers of a file to a model; those of a name that is there take its place.

    Raises:
        DocumentError: the file holds no markers.
    """
    result = read_any(path)
    if not isinstance(result, MarkerSet):
        raise DocumentError(
            f"the file holds a {type(result).__name__}, not a MarkerSet", file=str(path)
        )
    for marker in result.objects:
        for same in [item for item in model.marker_set.objects if item.name == marker.name]:
            model.marker_set.objects.remove(same)
        model.marker_set.objects.append(marker.copy_deep())


def _put(result: Scaled, name: str, document: Object) -> None:
    if name not in UNNAMED:
        result.texts[name] = to_text(document, numbers="opensim")
