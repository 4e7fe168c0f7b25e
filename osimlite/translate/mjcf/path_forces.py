"""Forces along paths other than muscles: actuators and springs on tendons."""

from __future__ import annotations

import numpy as np
from lxml.etree import _Element

from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.muscles import PathActuator
from osimlite.schema.path_forces import Blankevoort1991Ligament, Ligament, PathSpring
from osimlite.translate.fidelity import Error
from osimlite.translate.mjcf.coordinate_forces import add_scaled_actuator
from osimlite.translate.mjcf.draft import (
    MjcfDraft,
    PathTendon,
    Untranslatable,
    format_spring_length,
    format_value,
)
from osimlite.translate.mjcf.isometric import compute_isometric_tension


def add_actuator(draft: MjcfDraft, force: PathActuator, path: str) -> str:
    """Add an actuator whose tension is proportional to its control.

    Args:
        draft: MJCF under construction.
        force: actuator of the model.
        path: absolute path of the actuator.

    Returns:
        Kind and name of the element.
    """
    actuator = add_scaled_actuator(
        # A positive force of MuJoCo lengthens a tendon, that of a path actuator shortens it.
        draft,
        force,
        path,
        tendon=draft.find_tendon(path).name,
        gear=-force.optimal_force,
    )
    draft.record_result(path, actuator)
    return actuator


def add_spring(draft: MjcfDraft, force: PathSpring, path: str) -> str:
    """Make the tendon a spring whose tension is proportional to its stretch.

    Args:
        draft: MJCF under construction.
        force: spring of the model.
        path: absolute path of the spring.

    Returns:
        Kind and name of the element.
    """
    path_tendon, element = _find_tendon_element(draft, path)
    element.attrib.update(
        {
            "stiffness": format_value(force.stiffness),
            # Between 0 and the rest length the spring of MuJoCo is slack.
            "springlength": format_spring_length(0.0, force.resting_length),
        }
    )
    draft.record_result(path, f"tendon {path_tendon.name}")
    if force.dissipation:
        lost_behaviour = "damping that is proportional to the stretch"
        draft.fidelity.add(
            "damping", path, lost_behaviour, "no damping", f"dissipation {force.dissipation:g} s/m"
        )
    return f"tendon {path_tendon.name}"


def add_ligament(draft: MjcfDraft, force: Ligament | Blankevoort1991Ligament, path: str) -> str:
    """Make the tendon the spring that is nearest to the tension of the taut ligament.

    Args:
        draft: MJCF under construction.
        force: ligament of the model.
        path: absolute path of the ligament.

    Returns:
        Kind and name of the element.

    Raises:
        Untranslatable: the tension cannot be computed.
    """
    path_tendon, element = _find_tendon_element(draft, path)
    try:
        (tension,) = compute_isometric_tension(force, path_tendon.lengths, (0.0,))
        (held_out_tension,) = compute_isometric_tension(force, path_tendon.held_out, (0.0,))
    except OsimliteError as error:
        raise Untranslatable(f"its tension cannot be computed: {error.message}") from error
    # Slack poses are left out: a spring that fits them too would be too soft.
    stiffness, rest_length = _fit_spring(path_tendon.lengths[tension > 0.0], tension[tension > 0.0])
    element.attrib.update(
        {
            "stiffness": format_value(stiffness),
            "springlength": format_spring_length(0.0, rest_length),
        }
    )
    draft.record_result(path, f"tendon {path_tendon.name}")
    draft.fidelity.add(
        "ligament",
        path,
        "a ligament whose tension is not linear in its length",
        "the best-fitting linear spring, without damping",
        f"tendon {path_tendon.name}: {stiffness:g} N/m beyond {rest_length:g} m",
        {
            "tension": Error.measure(
                stiffness * np.maximum(path_tendon.held_out - rest_length, 0.0) - held_out_tension,
                "N",
            )
        },
    )
    return f"tendon {path_tendon.name}"


def _fit_spring(lengths: Array, tension: Array) -> tuple[float, float]:
    """Return stiffness (N/m) and rest length (m) of the spring nearest to tensions (N).

    Both are zero if it is never taut.
    """
    if len(np.unique(lengths)) < 2:
        # A line needs two lengths.
        return 0.0, 0.0
    slope, start = np.polyfit(lengths, tension, 1)
    return float(slope), float(-start / slope)


def _find_tendon_element(draft: MjcfDraft, path: str) -> tuple[PathTendon, _Element]:
    """Return the tendon of the path of a force, and its element."""
    path_tendon = draft.find_tendon(path)
    return path_tendon, next(
        element
        for element in draft.get_section("tendon")
        if element.get("name") == path_tendon.name
    )
