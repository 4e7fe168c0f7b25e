"""Forces along paths other than muscles: actuators and springs on the tendons of their paths."""

from __future__ import annotations

import numpy as np
from lxml.etree import _Element

from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.muscles import PathActuator
from osimlite.schema.path_forces import Blankevoort1991Ligament, Ligament, PathSpring
from osimlite.translate.fidelity import Error
from osimlite.translate.mjcf.coordinate_forces import scale_actuator
from osimlite.translate.mjcf.draft import Draft, Tied, Unsayable, text
from osimlite.translate.mjcf.isometric import isometric_tension


def actuator(draft: Draft, force: PathActuator, path: str) -> str:
    """A tension in proportion to the control."""
    made = scale_actuator(
        draft, force, path, tendon=draft.find_tendon(path).name, gear=-force.optimal_force
    )
    draft.account(path, made)
    return made


def spring(draft: Draft, force: PathSpring, path: str) -> str:
    """A tension in proportion to the stretch."""
    tied, element = _tendon(draft, path)
    element.attrib.update(
        {"stiffness": text(force.stiffness), "springlength": text((0.0, force.resting_length))}
    )
    draft.account(path, f"tendon {tied.name}")
    if force.dissipation:
        lost = "damping that grows with the stretch"
        draft.fidelity.add(
            "damping", path, lost, "no damping", f"dissipation {force.dissipation:g} s/m"
        )
    return f"tendon {tied.name}"


def ligament(draft: Draft, force: Ligament | Blankevoort1991Ligament, path: str) -> str:
    """The spring that is nearest to the tension where the ligament is taut."""
    tied, element = _tendon(draft, path)
    try:
        (tension,) = isometric_tension(force, tied.lengths, (0.0,))
        (other,) = isometric_tension(force, tied.held_out, (0.0,))
    except OsimliteError as error:
        raise Unsayable(f"its tension cannot be computed: {error.message}") from error
    stiffness, rest = _line(tied.lengths[tension > 0.0], tension[tension > 0.0])
    element.attrib.update({"stiffness": text(stiffness), "springlength": text((0.0, rest))})
    draft.account(path, f"tendon {tied.name}")
    draft.fidelity.add(
        "ligament",
        path,
        "a ligament whose tension is no line of its length",
        "the nearest spring without damping",
        f"tendon {tied.name}: {stiffness:g} N/m beyond {rest:g} m",
        {"tension": Error.of(stiffness * np.maximum(tied.held_out - rest, 0.0) - other, "N")},
    )
    return f"tendon {tied.name}"


def _line(lengths: Array, tension: Array) -> tuple[float, float]:
    """Stiffness (N/m) and length at rest (m) of the spring nearest to tensions (N); none where nothing is taut."""
    if len(np.unique(lengths)) < 2:
        return 0.0, 0.0
    slope, start = np.polyfit(lengths, tension, 1)
    return float(slope), float(-start / slope)


def _tendon(draft: Draft, path: str) -> tuple[Tied, _Element]:
    """The tendon of the path of a force, and its element."""
    tied = draft.find_tendon(path)
    return tied, next(item for item in draft.section("tendon") if item.get("name") == tied.name)
