"""Forces and actuators: the function that translates each class, if MuJoCo has its law."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from osimlite.base.text import add_article
from osimlite.errors import ModelError
from osimlite.schema.forces import Force
from osimlite.schema.muscles import Muscle
from osimlite.simulation.elements.registry import FORCE_TYPES
from osimlite.translate.fidelity import LEFT_OUT
from osimlite.translate.mjcf import coordinate_forces as on_coordinates
from osimlite.translate.mjcf import frame_forces as on_frames
from osimlite.translate.mjcf import path_forces as on_paths
from osimlite.translate.mjcf.draft import MjcfDraft, Untranslatable
from osimlite.translate.mjcf.muscles import add_muscle

MAKERS: Mapping[str, Callable[[MjcfDraft, Any, str], str]] = {
    "CoordinateActuator": on_coordinates.add_actuator,
    "ActivationCoordinateActuator": on_coordinates.add_lagging_actuator,
    "SpringGeneralizedForce": on_coordinates.add_spring,
    "CoordinateLimitForce": on_coordinates.add_limit,
    "PointToPointSpring": on_frames.add_point_spring,
    "PointToPointActuator": on_frames.add_point_to_point_actuator,
    "TorqueActuator": on_frames.add_torque_actuator,
    "PointActuator": on_frames.add_point_actuator,
    "BodyActuator": on_frames.add_body_actuator,
    "BushingForce": on_frames.add_bushing,
    "PathActuator": on_paths.add_actuator,
    "PathSpring": on_paths.add_spring,
    "Ligament": on_paths.add_ligament,
    "Blankevoort1991Ligament": on_paths.add_ligament,
}
"""Functions that add a force of a class, without muscles, and return what it became.

They raise `Untranslatable` if MuJoCo cannot express it.
"""


def add_forces(draft: MjcfDraft) -> None:
    """Add every active force whose law MuJoCo has."""  # noqa: DOC501 - the error is caught here
    for force, path in draft.iterate_components(Force):
        class_name = type(force).__name__
        try:
            if not force.appliesForce:
                raise Untranslatable("its appliesForce is false")
            # A muscle class that osimlite cannot compute has no tension to fit to.
            if isinstance(force, Muscle) and FORCE_TYPES.find(type(force)):
                draft.fidelity.translated[path] = add_muscle(draft, force, path)
            elif class_name in MAKERS:
                draft.fidelity.translated[path] = MAKERS[class_name](draft, force, path)
        except (ModelError, Untranslatable) as error:
            draft.fidelity.add("force", path, add_article(class_name), f"{LEFT_OUT}: {error}")
