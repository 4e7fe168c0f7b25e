"""Messages about fits: errors, coordinates that nothing determines, and parts of unknown classes."""

from __future__ import annotations

import math
from collections.abc import Iterator

from osimlite.base.text import format_count, join_words
from osimlite.fitting.fitted_motion import MARKER_ERROR_LIMITS_M, FittedMotion
from osimlite.schema.base import Unknown
from osimlite.schema.model import Model

IMPLAUSIBLE_ERROR_M = 1.0
"""Root mean square of marker errors (m) that no pose of a person leaves."""
MAX_NAMED_COORDINATES = 8
"""Number of undetermined coordinates that a message names."""
RECOMMENDS = "OpenSim recommends"
"""Begins the note of a message about marker errors beyond the recommended limits."""
NO_EFFECT = "Such parts have no effect on the fit"
"""Consequence for parts of unknown classes where a motion is fitted to markers."""
MAX_NAMED_PARTS = 3
"""Number of parts that a message names."""


def describe_fit(
    motion: FittedMotion, advice: tuple[float, float] = MARKER_ERROR_LIMITS_M, marker_note: str = ""
) -> Iterator[tuple[str, str]]:
    """Yield messages about a fitted motion.

    Args:
        motion: motion that fits measurements.
        advice: limits of the root mean square and of the largest marker error that OpenSim's
            documentation recommends, m.
        marker_note: text that says for which markers the limits hold.

    Yields:
        Subject of the message (markers, sensors or coordinates), and its text.
    """
    result = motion.summary
    measured = "markers" if motion.markers else "sensors"
    if "rms_marker_error" in result:
        rms = result["rms_marker_error"]
        largest = result["largest_marker_error"]
        limits_text = (
            f"{100.0 * advice[0]:g} cm (root mean square) and {100.0 * advice[1]:g} cm (largest)"
        )
        advice_text = (
            ""
            if rms < advice[0] and largest < advice[1]
            else f"; {RECOMMENDS} less than {limits_text}{marker_note}"
        )
        # Errors of metres are typical of millimetres that are read as metres.
        advice_text += "; check the units of the data" if rms > IMPLAUSIBLE_ERROR_M else ""
        yield (
            "markers",
            f"{format_count(result['frames'], 'frame')}, "
            f"{format_count(result['markers'], 'marker')}: errors of {100.0 * rms:.2f} cm (root "
            f"mean square), at most {100.0 * largest:.2f} cm ({result['worst_marker']} at "
            f"{result['worst_time']:g} s){advice_text}",
        )
    if "rms_orientation_error" in result:
        rms, largest = (
            math.degrees(result[f"{statistic}_orientation_error"])
            for statistic in ("rms", "largest")
        )
        yield (
            "sensors",
            f"{format_count(result['frames'], 'frame')}, {format_count(result['sensors'], 'sensor')}: "
            f"errors of {rms:.2f} degrees "
            f"(root mean square), at most {largest:.2f} degrees ({result['worst_sensor']} at "
            f"{result['worst_sensor_time']:g} s)",
        )
    if result["partly_unseen"]:
        unseen_shares = [
            f"{name} ({100.0 * unseen_fraction:.3g} %)"
            for name, unseen_fraction in result["partly_unseen"].items()
        ]
        yield measured, f"share of the frames without a measurement: {join_words(unseen_shares)}"
    if result["frames_unseen"]:
        frames = format_count(result["frames_unseen"], "frame")
        yield (
            measured,
            f"{frames} without a measurement of positive weight: these frames get the pose of the "
            "frame before",
        )
    if motion.undetermined:
        yield (
            "coordinates",
            "no measurement determines "
            f"{join_words(motion.undetermined, max_count=MAX_NAMED_COORDINATES)}, which stay near "
            "the default pose; OpenSim may find other values, such as the middle of their ranges. "
            "Lock them, or add tasks for them",
        )
    if result["frames_unsettled"]:
        frames = format_count(result["frames_unsettled"], "frame")
        yield measured, f"the solver did not converge in {frames}"


def find_unknown(model: Model) -> list[str]:
    """Return the parts of a model whose classes are unknown, each as ``path (class)``."""
    tree = model.tree()
    unknown_objects = [
        unknown_object for unknown_object in model.walk() if isinstance(unknown_object, Unknown)
    ]
    return [
        f"{tree.path_of(unknown_object) or unknown_object.name or 'a part'} ({unknown_object.class_name})"
        for unknown_object in unknown_objects
    ]


def describe_unknown(model: Model, consequence: str) -> str:
    """Return a sentence that names the parts of unknown classes, or "" without such parts.

    Args:
        model: model that may have parts of unknown classes.
        consequence: sentence about these parts without a full stop, for example "Such parts are not
            scaled".
    """
    unknown_parts = find_unknown(model)
    if not unknown_parts:
        return ""
    return (
        f"osimlite does not know the classes of {format_count(len(unknown_parts), 'part')}: "
        f"{join_words(unknown_parts, max_count=MAX_NAMED_PARTS)}. {consequence}. OpenSim refuses the "
        "model unless the plug-in of these classes is loaded"
    )
