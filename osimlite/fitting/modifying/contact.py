"""Smooth contact: replace HuntCrossleyForce by SmoothSphereHalfSpaceForce."""

from __future__ import annotations

from typing import Any

from osimlite.errors import UnsupportedError
from osimlite.schema.contact_forces import SmoothSphereHalfSpaceForce
from osimlite.schema.contact_types import ContactHalfSpace, ContactSphere
from osimlite.schema.forces import HuntCrossleyForce
from osimlite.schema.model import Model


def smooth_contacts(model: Model) -> None:
    """Replace all Hunt-Crossley forces between spheres and half spaces by smooth forces.

    Simbody combines both surfaces: stiffnesses as springs in series, dissipations by the share of
    the deformation, friction by the harmonic mean. If both surfaces are alike, the smooth force has
    the same numbers.

    Raises:
        UnsupportedError: a force is between other surfaces.
    """
    geometries = {item.name: item for item in model.contact_geometry_set.objects}
    for force in [item for item in model.force_set.objects if isinstance(item, HuntCrossleyForce)]:
        parameters_by_name: dict[str, Any] = {}
        for parameters in force.contact_parameters.objects:
            parameters_by_name |= dict.fromkeys(
                (_get_geometry_name(item) for item in parameters.geometry), parameters
            )
        spheres = [
            name for name in parameters_by_name if isinstance(geometries.get(name), ContactSphere)
        ]
        planes = [
            name
            for name in parameters_by_name
            if isinstance(geometries.get(name), ContactHalfSpace)
        ]
        if len(spheres) + len(planes) < len(parameters_by_name) or not planes or not spheres:
            raise UnsupportedError(
                f"'{force.name}' is not between spheres and half spaces; only these have a smooth "
                "force"
            )
        smooth_forces = [
            _create_smooth_force(
                force, sphere, plane, parameters_by_name, len(spheres) * len(planes) > 1
            )
            for plane in planes
            for sphere in spheres
        ]
        index = model.force_set.objects.index(force)
        model.force_set.objects[index : index + 1] = smooth_forces


def _get_geometry_name(geometry: Any) -> str:
    """Return the name of a geometry, or the last part of its path."""
    return str(getattr(geometry, "name", geometry)).rpartition("/")[2]


def _create_smooth_force(
    force: Any, sphere: str, plane: str, parameters_by_name: dict[str, Any], has_several_pairs: bool
) -> SmoothSphereHalfSpaceForce:
    """Return the smooth force between one sphere and one half space."""
    sphere_parameters, plane_parameters = parameters_by_name[sphere], parameters_by_name[plane]
    # Hertz contact: the deformation is proportional to stiffness^(-2/3) for a given force.
    softness = [
        parameters.stiffness ** (-2.0 / 3.0) if parameters.stiffness else float("inf")
        for parameters in (sphere_parameters, plane_parameters)
    ]
    # The softer surface yields more, so its dissipation counts more.
    sphere_fraction = softness[0] / sum(softness)

    def mean(name: str) -> float:
        a, b = getattr(sphere_parameters, name), getattr(plane_parameters, name)
        # Simbody's harmonic mean of two friction coefficients.
        return 2.0 * a * b / (a + b) if a + b else 0.0

    return SmoothSphereHalfSpaceForce(
        name=f"{force.name}_{sphere}" if has_several_pairs else force.name,
        appliesForce=force.appliesForce,
        socket_sphere=f"/contactgeometryset/{sphere}",
        socket_half_space=f"/contactgeometryset/{plane}",
        # Springs in series: deformations add up; the factor 2 makes equal surfaces keep their
        # number.
        stiffness=(2.0 / sum(softness)) ** 1.5,
        dissipation=sphere_parameters.dissipation * sphere_fraction
        + plane_parameters.dissipation * (1.0 - sphere_fraction),
        static_friction=mean("static_friction"),
        dynamic_friction=mean("dynamic_friction"),
        viscous_friction=mean("viscous_friction"),
        transition_velocity=force.transition_velocity,
    )
