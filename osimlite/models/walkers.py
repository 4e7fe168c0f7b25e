"""Walkers with stable gait cycles, and the walker of the exercise with its longest walk.

Each is the model of the exercise (:func:`osimlite.models.dynamic_walker.dynamic_walker`) with few
changed numbers, and starts from its default values and speeds in the middle of a step.
`docs/gaits.md` describes the search that found them.
"""

from __future__ import annotations

from collections.abc import Mapping

from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.contact_types import ContactSphere
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.forces import CoordinateLimitForce, HuntCrossleyForce
from osimlite.schema.frames import Body
from osimlite.schema.geometry_types import Brick
from osimlite.schema.model import Model

STEADY_START = {
    "Pelvis_ty": (0.8871465537538683, 0.06250295666110672),
    "Pelvis_tx": (0.0, 0.3319889808349588),
    "RHip_rz": (0.0677445901914954, -0.3901233055848151),
    "LHip_rz": (0.5771152006418845, 3.2600073020755884),
    "RKnee_rz": (0.08302322544374824, 0.07743947068366194),
    "LKnee_rz": (-1.3832146912601972, -1.2144648371656874),
}
"""Value and speed of each coordinate on the cycle of the steady walker, at 0.4 of a step after
touch-down.
"""


HUMAN_START = {
    "Pelvis_ty": (0.9, 0.031),
    "Pelvis_tx": (0.0, 0.44),
    "RHip_rz": (0.0081, -0.49),
    "LHip_rz": (0.22, 0.99),
    "RKnee_rz": (0.038, 0.011),
    "LKnee_rz": (-0.74, 2.4),
}
"""Value and speed of each coordinate of the human walker in the middle of a step, rounded to two digits."""


FURTHEST_START = {
    "Pelvis_tx": (0.0, 0.0751894),
    "Pelvis_ty": (0.723773, 0.225237),
    "RHip_rz": (-0.344029, -0.961231),
    "LHip_rz": (0.0945, 3.56844),
    "RKnee_rz": (-0.547171, 2.01019),
    "LKnee_rz": (-1.7308, 3.35975),
}
"""Value and speed of each coordinate of the best initial state that was found for the walker of the
exercise.
"""


def furthest_walker() -> Model:
    """Build the walker of the exercise with the initial state from which it makes four steps.

    It stands on its right foot, which is at rest, with the left leg drawn up and swinging forward.
    No cycle was found for this walker: the inertia of its shanks is so large that a leg swings too
    slowly.

    Returns:
        The model.
    """
    model = dynamic_walker()
    model.name = "FurthestWalker"
    return _set_start_and_track(model, FURTHEST_START, 10.0)


def steady_walker(shank_inertia: float = 0.0921, foot_ahead: float = 0.0744) -> Model:
    """Build a walker that differs from that of the exercise in two properties and never stops.

    Its shanks have a smaller moment of inertia about the knee axis (1 kg·m² in the exercise), and
    its feet are ahead of the shanks' axes (on them in the exercise). It walks down the slope of the
    exercise, 10 degrees.

    Args:
        shank_inertia: moment of inertia of each shank about its mass centre and the knee axis
            (kg·m²).
        foot_ahead: distance of the sphere of each foot in front of the shank's axis (m).

    Returns:
        The model.
    """
    model = dynamic_walker()
    model.name = "SteadyWalker"
    for body in model.components(Body):
        if body.name.endswith("Shank"):
            # Only the moment about z matters for a motion in the sagittal plane.
            body.inertia = (1.0, 1.0, shank_inertia, 0.0, 0.0, 0.0)
    for sphere in model.components(ContactSphere):
        if sphere.name.endswith("FootContact"):
            _, y, z = sphere.location
            sphere.location = (foot_ahead, y, z)
    return _set_start_and_track(model, STEADY_START, 100.0)


def human_walker(
    slope: float = 2.71,
    foot_radius: float = 0.121,
    foot_ahead: float = 0.0455,
    knee_stiffness: float = 20.1,
) -> Model:
    """Build a walker with the mass distribution of a human, on a gentle slope.

    Of 71.3 kg, head, arms and trunk weigh 47.5 kg and stand on the hips, a thigh weighs 7.9 kg and
    a shank with its foot 4 kg. Mass centres and radii of gyration are near those of D. A. Winter
    (Biomechanics and Motor Control of Human Movement). The feet are round, as those of McGeer's
    walkers.

    Args:
        slope: inclination of the platform towards +x (deg).
        foot_radius: radius of the sphere of each foot (m); its lowest point is that of the
            exercise.
        foot_ahead: distance of the sphere in front of the shank's axis (m).
        knee_stiffness: stiffness of the stops of the knees (N·m/deg).

    Returns:
        The model.
    """
    model = dynamic_walker(slope=slope)
    model.name = "HumanWalker"
    for body in model.components(Body):
        if body.name == "Pelvis":
            # Head, arms and trunk; the pelvis of the exercise is the only body above the hips.
            body.mass = 47.5
        elif body.name.endswith("Thigh"):
            body.mass = 7.9
            body.mass_center = (0.0, 0.027, 0.0)
            body.inertia = (2.0, 2.0, 0.11, 0.0, 0.0, 0.0)
        elif body.name.endswith("Shank"):
            body.mass = 4.0
            body.mass_center = (0.0, -0.046, 0.0)
            body.inertia = (1.0, 1.0, 0.133, 0.0, 0.0, 0.0)
    for sphere in model.components(ContactSphere):
        if sphere.name.endswith("FootContact"):
            _, y, z = sphere.location
            # A larger sphere with the same lowest point keeps the length of the leg.
            sphere.location = (foot_ahead, y - sphere.radius + foot_radius, z)
            sphere.radius = foot_radius
    for contact in model.components(HuntCrossleyForce):
        for parameters in contact.contact_parameters.objects:
            parameters.stiffness = 1.55e7
            parameters.dissipation = 5.2
    for limit in model.components(CoordinateLimitForce):
        if limit.name.endswith("KneeLimitTorque"):
            limit.upper_stiffness = knee_stiffness
            limit.lower_stiffness = 20.0
            limit.damping = 0.265
    return _set_start_and_track(model, HUMAN_START, 100.0)


def _set_start_and_track(
    model: Model, start: Mapping[str, tuple[float, float]], distance: float
) -> Model:
    """Set the initial state, and extend platform and coordinate range for a distance `distance` (m).

    Returns:
        The same model.
    """
    for coordinate in model.components(Coordinate):
        if coordinate.name in start:
            coordinate.default_value, coordinate.default_speed_value = start[coordinate.name]
        if coordinate.name == "Pelvis_tx":
            # The range does not limit the motion; it tells how far the walker may go.
            coordinate.range = (-1.0, distance)
        elif coordinate.name.endswith("Knee_rz"):
            # The stops of the knees are elastic, so that the knees exceed 0 a little.
            coordinate.range = (coordinate.range[0], 0.5)
    for platform in model.components(Brick):
        _, thickness, width = platform.half_lengths
        platform.half_lengths = (distance, thickness, width)
    return model
