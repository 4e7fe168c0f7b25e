"""Measurements of a model's paths and muscles, for the rules that need them, and their cache.

The linter itself computes without a numeric library. Numbers that need one come from
`osimlite.lint.measuring`, which stands above the linter and the simulation: it is imported by name,
and only for models that have something to measure.

Measurements are cached by digests of the parts of a text, in memory and on disk beside the cached
findings. A path is measured again when its own element has changed; all paths are measured again
when anything that paths depend on has changed.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Container
from hashlib import blake2b
from importlib import import_module
from math import degrees
from typing import TYPE_CHECKING, Any, cast

from osimlite.base.files import read_file
from osimlite.base.named_tuples import NamedTuple
from osimlite.base.pruning import mark_used
from osimlite.base.require import find_missing_packages
from osimlite.base.text import join_words
from osimlite.base.writing import write_cached
from osimlite.errors import OsimliteError
from osimlite.schema.specs import get_class_names

if TYPE_CHECKING:
    from pathlib import Path

    from osimlite.lint.subject import Subject


MECHANISM = "mechanism"
"""Key of the mechanism that construction has built, kept with a subject until its paths and muscles are measured."""

MEASURES = "measures"
"""Value of `about` of the rules that need measurements, and key of these in a subject."""

NEEDS_SIM = "they need osimlite[sim]"
"""Beginning of the reason why nothing is measured without the numeric packages."""

MAX_WRAPS_UNCOMPILED = 12
"""Number of wraps up to which kernels are not compiled for a model."""

_MEASURED = ("Muscle", "PathWrap", "ConditionalPathPoint", "MovingPathPoint")


class CoordinateSetting(NamedTuple):
    """Value of a coordinate in its unit: rad, m or none."""

    coordinate: str
    value: float
    unit: str

    def __str__(self) -> str:
        return f"'{self.coordinate}' = {self.format_value(self.value, 4)}"

    def format_value(self, value: float, digits: int) -> str:
        """Format a value of the coordinate with its unit; angles in degrees.

        Returns:
            Number and unit, such as ``30 deg``.
        """
        display_value, unit = (degrees(value), "deg") if self.unit == "rad" else (value, self.unit)
        return f"{display_value:.{digits}g} {unit}".rstrip()


class MeasuringPose(NamedTuple):
    """Default pose except for some coordinates."""

    values: tuple[CoordinateSetting, ...] = ()

    def __str__(self) -> str:
        return f"at {join_words(map(str, self.values))}" if self.values else "in the default pose"


class WrappingError(NamedTuple):
    """Path length around surfaces in OpenSim compared with geodesics."""

    owner: str  # path of the component that has the path
    surfaces: tuple[str, ...]  # names of the surfaces
    default: float  # excess length in the default pose, m; NaN if there is no geodesic
    worst: float  # largest excess length, m
    pose: MeasuringPose  # pose with the largest excess length


class PathJump(NamedTuple):
    """Jump of a path length (m), its pose, and the points or surfaces that appear or disappear."""

    owner: str
    size: float
    pose: MeasuringPose
    parts: tuple[str, ...]


class LengthOnSurface(NamedTuple):
    """Length of a path on a surface (m) that is negative, or NaN where OpenSim finds no path around it."""

    owner: str
    surface: str
    length: float
    pose: MeasuringPose


class MovingPoint(NamedTuple):
    """Moving point at an end of its coordinate's range."""

    owner: str  # path of the component that has the point
    point: str  # name of the point
    end: CoordinateSetting  # end of the range of the coordinate
    # Distance of the coordinate from the range in which the functions are defined (rad or m), 0 if
    # inside.
    beyond: float
    displacement: float  # displacement of the point over that distance, m
    # Derivative of the position by the coordinate with which OpenSim continues outside of the
    # range, m/rad or 1.
    rate: float


class MuscleStart(NamedTuple):
    """Initial state and equilibrium of a muscle at the same activation in the default pose."""

    owner: str  # path of the muscle
    # Fiber lengths in optimal fiber lengths; NaN without an equilibrium.
    lengths: tuple[float, float]
    tensions: tuple[float, float]  # tendon forces in max_isometric_force


class FiberReach(NamedTuple):
    """Equilibrium of muscle fibers: fully active at the shortest path, or at rest at the longest path."""

    owner: str  # path of the muscle
    is_active: bool  # whether the muscle is fully active
    pose: MeasuringPose  # pose with the shortest or longest path
    length: float  # fiber length in optimal fiber lengths
    is_limit: bool  # whether it is the least length that curves and pennation allow


class Measures(NamedTuple):
    """Measurements of a model."""

    # Indices in the mechanism of the coordinates that change the length of a path, by path. All of
    # these coordinates are swept, for every path.
    swept: dict[str, tuple[int, ...]]
    wrappings: list[WrappingError]
    jumps: list[PathJump]
    on_surfaces: list[LengthOnSurface]
    moving_points: list[MovingPoint]
    starts: list[MuscleStart]
    reaches: list[FiberReach]


def select_owners(measures: Measures, owners: Container[str]) -> Measures:
    """Return the measurements of some paths."""
    lists: Any = measures[1:]
    swept = {owner: indices for owner, indices in measures.swept.items() if owner in owners}
    return Measures(
        swept,
        *(
            [measurement for measurement in measurements if measurement.owner in owners]
            for measurements in lists
        ),
    )


def merge_measures(first: Measures, second: Measures) -> Measures:
    """Return the measurements of two disjoint sets of paths together."""
    lists: Any = zip(first[1:], second[1:], strict=True)
    return Measures(
        first.swept | second.swept,
        *([*first_list, *second_list] for first_list, second_list in lists),
    )


def find_swept_coordinates(measures: Measures) -> set[int]:
    """Return the indices of the coordinates that change the length of a path."""
    return {index for indices in measures.swept.values() for index in indices}


class NoMachineCodeError(OsimliteError):
    """Error for a model whose measurement takes too long, since kernels run as Python."""


def has_measures(subject: Subject) -> bool:
    """Return whether a model has muscles, or paths whose lengths do not follow from fixed points."""
    return any(next(subject.find_by_class(name), None) is not None for name in _MEASURED)


def measure_subject(subject: Subject, *, compute: bool = True) -> str:
    """Measure a model, or recall its measurements; return the reason of a failure.

    Args:
        subject: check target with the model, which keeps the measurements.
        compute: whether the model is measured if necessary; otherwise only earlier measurements are
            recalled.

    Returns:
        The reason why the model was not measured; empty on success.
    """
    from osimlite.schema.tree import lend_tree

    compiles = sum(1 for _ in subject.find_by_class("PathWrap")) > MAX_WRAPS_UNCOMPILED
    missing_packages = find_missing_packages("numpy")
    if missing_packages:
        verb = "is" if len(missing_packages) == 1 else "are"
        return (
            f"{NEEDS_SIM} ({join_words(missing_packages)} {verb} not installed); run: pip install "
            "'osimlite[sim]'"
        )
    mechanism = subject.cache.pop(MECHANISM, None)
    text_parts = digest_parts(subject)
    remembered_measures = (
        None if text_parts is None else recall_measures(text_parts, subject.cache_folder)
    )
    if text_parts is not None and remembered_measures is not None:
        unchanged = remembered_measures.select_unchanged(text_parts)
        if unchanged.swept.keys() == text_parts.paths.keys() and find_swept_coordinates(
            unchanged
        ) == find_swept_coordinates(remembered_measures.measures):
            subject.cache[MEASURES] = unchanged
            return ""
    if not compute:
        return "not requested"
    try:
        measured = import_module("osimlite.lint.measuring").measure_model
        assert subject.model is not None
        earlier_measures = (
            None
            if text_parts is None or remembered_measures is None
            else (remembered_measures.measures, remembered_measures.select_unchanged(text_parts))
        )
        with lend_tree(subject.tree):
            result = measured(
                subject.model, compiles=compiles, earlier=earlier_measures, mechanism=mechanism
            )
    except NoMachineCodeError as error:
        subject.needs_remeasuring = True
        return error.message
    except (ArithmeticError, ValueError, OsimliteError) as error:
        fault = error.__context__ if isinstance(error, OsimliteError) else error
        if not isinstance(fault, ArithmeticError | ValueError):
            return str(getattr(error, "message", error))
        # Other rules report numbers with which nothing can be computed.
        return "a number is too large to compute with"
    subject.cache[MEASURES] = result
    if text_parts is not None:
        remember_measures(text_parts, result, subject.cache_folder)
    return ""


def get_measures(subject: Subject) -> Measures:
    """Return the measurements of a model."""
    return cast("Measures", subject.cache[MEASURES])


MAX_REMEMBERED_MODELS = 16
"""Number of models whose measurements stay in memory."""

_INDEPENDENT_CLASSES = {"Geometry", "Marker", "Controller", "Probe", "ContactGeometry"}
"""Classes of objects that no path depends on."""


class TextParts(NamedTuple):
    """Digests of the parts of a text."""

    common: str  # digest of everything on which all paths depend
    paths: dict[str, str]  # digest of the element of each path's owner, by component path


class RememberedMeasures(NamedTuple):
    """Measurements with the digests of the elements that they belong to, by path of the owner."""

    paths: dict[str, str]
    measures: Measures

    def select_unchanged(self, parts: TextParts) -> Measures:
        """Return the measurements of the paths whose elements have not changed."""
        return select_owners(
            self.measures,
            {path for path, digest in self.paths.items() if parts.paths.get(path) == digest},
        )


remembered: OrderedDict[str, RememberedMeasures] = OrderedDict()


def digest_parts(subject: Subject) -> TextParts | None:
    """Return digests of the parts of a text; None without a text, or if it includes other files."""
    source = subject.source
    if (
        source is None
        or not source.well_formed
        or subject.config.classes
        or subject.notes_of("include")
    ):
        return None
    spans: list[tuple[int, int, str]] = []
    for cls, items in subject.by_class.items():
        has_path = "geometry_path" in cls.model_fields
        if not has_path and _INDEPENDENT_CLASSES.isdisjoint(get_class_names(cls)):
            continue
        for item in items:
            if item._index is not None:
                span = source.spans[item._index]
                spans.append((span.start, span.end, subject.path(item) if has_path else ""))
            elif has_path:
                return None
    common_digest = blake2b(str(subject.version).encode(), digest_size=16)
    paths = dict[str, str]()
    covered_end = 0
    for start, end, path in sorted(spans):
        if start >= covered_end:
            # White space around an element has no meaning: an added element must not change the
            # digest of its surroundings.
            common_digest.update(source.text[covered_end:start].strip().encode("utf-8", "replace"))
            covered_end = end
        if path:
            paths[path] = blake2b(
                source.text[start:end].encode("utf-8", "replace"), digest_size=16
            ).hexdigest()
    common_digest.update(source.text[covered_end:].strip().encode("utf-8", "replace"))
    return TextParts(common_digest.hexdigest(), paths)


def recall_measures(parts: TextParts, folder: Path | None) -> RememberedMeasures | None:
    """Return cached measurements of a model with these parts; some paths may be missing.

    Args:
        parts: digests of the parts of the model's text.
        folder: folder of the cache; None for the memory alone.
    """
    recalled = remembered.get(parts.common)
    if recalled is None and folder is not None:
        from pydantic import TypeAdapter, ValidationError

        try:
            recalled = TypeAdapter(RememberedMeasures).validate_json(
                read_file(_cache_file(folder, parts)), strict=True
            )
        except (OsimliteError, ValidationError):
            return None
        mark_used(_cache_file(folder, parts))
        remembered[parts.common] = recalled
    return recalled


def remember_measures(parts: TextParts, measures: Measures, folder: Path | None) -> None:
    """Cache the measurements of a model.

    Args:
        parts: digests of the parts of the model's text.
        measures: measurements of the model.
        folder: folder of the cache; None for the memory alone.
    """
    entry = remembered[parts.common] = RememberedMeasures(parts.paths, measures)
    remembered.move_to_end(parts.common)
    while len(remembered) > MAX_REMEMBERED_MODELS:
        remembered.popitem(last=False)
    if folder is not None:
        from pydantic import ConfigDict, TypeAdapter

        adapter = TypeAdapter(RememberedMeasures, config=ConfigDict(ser_json_inf_nan="constants"))
        write_cached(_cache_file(folder, parts), adapter.dump_json(entry))


def _cache_file(folder: Path, parts: TextParts) -> Path:
    return folder / "measured" / f"{parts.common}.json"
