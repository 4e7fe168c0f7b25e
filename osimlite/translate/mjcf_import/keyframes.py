"""Keyframes: the default pose, and a table of all of them."""

from __future__ import annotations

import numpy as np

from osimlite.base.text import join_words, suggest_name
from osimlite.errors import SettingError
from osimlite.translate.mjcf_import.coordinate_map import CoordinateMap
from osimlite.translate.mjcf_import.draft import ConversionDraft


def add_keyframes(draft: ConversionDraft) -> None:
    """Write all keyframes into a table, and set the default pose from the requested keyframe.

    Raises:
        SettingError: the file has no keyframe with the requested name.
    """
    model = draft.mj
    names = [draft.source.name_of("key", key) for key in range(model.nkey)]
    requested = draft.options.keyframe
    if requested is not None and requested not in names:
        hint = suggest_name(requested, names) or f"; it has {join_words(names) or 'no keyframes'}"
        raise SettingError(f"the file has no keyframe '{requested}'{hint}")
    if not names:
        return
    coordinates = CoordinateMap.build(model, draft.coordinates, draft.rotors)
    rows = [coordinates.values(np.array(model.key_qpos[key])) for key in range(model.nkey)]
    labels = coordinates.names()
    file = f"{draft.source.path.stem}_keyframes.mot"
    lines = [
        "keyframes of MuJoCo, one a row",
        "version=1",
        f"nRows={len(rows)}",
        f"nColumns={len(labels) + 1}",
        "inDegrees=no",
        "endheader",
        "\t".join(["time", *labels]),
    ]
    for key, values in enumerate(rows):
        lines.append("\t".join([str(key), *(repr(values[label]) for label in labels)]))
        lost_quantities = [
            quantity
            for quantity, numbers in (
                ("speeds", model.key_qvel[key]),
                ("activations", model.key_act[key]),
                ("controls", model.key_ctrl[key]),
            )
            if np.any(numbers)
        ]
        if lost_quantities:
            draft.record(
                "key",
                key,
                f"{', '.join(lost_quantities)} of a keyframe",
                f"only the pose is written, in row {key} of {file}",
            )
        else:
            draft.note_result("key", key, f"row {key} of {file}")
    draft.files[file] = "\n".join(lines) + "\n"
    if requested is not None:
        set_default_pose(draft, rows[names.index(requested)])


def set_default_pose(draft: ConversionDraft, values: dict[str, float]) -> None:
    """Set the default values of coordinates; ranges are widened to contain them."""
    for name, value in values.items():
        coordinate = draft.made[name]
        lower, upper = coordinate.range
        coordinate.range = (min(lower, value), max(upper, value))
        coordinate.default_value = value
