"""Scaling of a model: properties by the rules of their classes, then masses and fiber lengths.

The rules are in the `facts` of the classes. Inertias follow OpenSim's rules.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from math import sqrt
from typing import Any

import numpy as np

from osimlite.errors import ModelError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.schema_frames import Placements
from osimlite.mechanics.multibody.spatial import Array, rotation_xyz
from osimlite.schema.base import Component
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.custom_joint import SpatialTransform
from osimlite.schema.facts import ACROSS, ALONG, AXES, HOLDER, MEAN, PATH, SELF, Facts
from osimlite.schema.frames import Body, PhysicalFrame
from osimlite.schema.functions import Function, LinearFunction, MultiplierFunction
from osimlite.schema.joints import Joint
from osimlite.schema.model import Model
from osimlite.schema.resolution import is_a
from osimlite.schema.wrapping import WrapObject

Factors = Mapping[str, Sequence[float]]
"""Factors along the x, y and z axes of bodies, by name; other bodies keep their size."""

MASSLESS_KG = 2.0**-52
"""Mass up to which OpenSim treats a body as massless, kg."""
FACTOR_TOLERANCE = 2.0 ** (-52.0 * 7.0 / 8.0)
"""Relative difference of factors that OpenSim treats as equal."""
TRANSLATIONS = ("translation1", "translation2", "translation3")
"""Names of the translation axes of a SpatialTransform."""


def scale_model(
    model: Model,
    factors: Factors,
    mass: float = -1.0,
    *,
    preserve_mass_distribution: bool = False,
    mechanism: Mechanism | None = None,
) -> None:
    """Scale a model, as OpenSim's Model::scale does.

    Frame offsets, stations, path points, wrap surfaces, mass centres and joint translations are
    multiplied by the factors of the body to which they are fixed. Optimal fiber, tendon slack and
    resting lengths are multiplied by the ratio of the path lengths in the default pose. Forces,
    stiffnesses, ranges of coordinates and contact geometry stay.

    Args:
        model: model to scale; it is changed in place.
        factors: scale factors of the bodies.
        mass: total mass, kg; if it is not positive, the mass follows from the factors.
        preserve_mass_distribution: whether the bodies keep their shares of the mass; otherwise
            larger bodies are heavier.
        mechanism: mechanism of the model before scaling; built by default.

    Raises:
        ModelError: a coupler determines a translation of a body with different factors along its
            axes.
        OsimliteError: osimlite cannot compute the paths of the model.
    """
    mechanism = build_mechanism(model) if mechanism is None else mechanism
    # Lengths before scaling: fibers and tendons scale with the ratio.
    lengths_before = compute_path_lengths(model, mechanism)
    scaler = _Scaler(model, factors, mechanism)
    for component in scaler.tree.components:
        # Internal components belong to their owner, whose rule covers them.
        if not scaler.tree.is_internal(component):
            scaler.scale_component(component)
    for body in model.components(Body):
        body_factors = scaler.get_base_factors(body)
        if body_factors is not None:
            scale_inertia(body, body_factors, scales_mass=not preserve_mass_distribution)
    # The requested mass rescales all bodies alike, as in OpenSim.
    if mass > 0.0:
        total = sum(body.mass for body in model.components(Body))
        if total > 0.0:
            for body in model.components(Body):
                body.mass *= mass / total
                body.inertia = tuple(mass / total * moment for moment in body.inertia)  # type: ignore[assignment]
    lengths_after = compute_path_lengths(model) if lengths_before else {}
    for path, length in lengths_before.items():
        if length > 0.0:
            path_component = model[path]
            for name, rule in get_scale_rules(type(path_component)).items():
                if rule == PATH:
                    setattr(
                        path_component,
                        name,
                        getattr(path_component, name) * (lengths_after[path] / length),
                    )


def compute_path_lengths(model: Model, mechanism: Mechanism | None = None) -> dict[str, float]:
    """Return the lengths of paths in the default pose, for components that scale with their path.

    Args:
        model: model with the paths.
        mechanism: mechanism of the model; built by default.

    Returns:
        Length (m) by path of the component.
    """
    components = [
        component
        for component in model.components()
        if PATH in get_scale_rules(type(component)).values()
    ]
    if not components:
        return {}
    from osimlite.simulation.paths import paths

    result = paths(model, mechanism=mechanism)
    lengths = result.lengths(result.mechanism.assemble({}))
    return {
        path: lengths[path]
        for path in (component.path for component in components)
        if path in lengths
    }


@cache
def get_scale_rules(cls: type[Any]) -> dict[str, str]:
    """Return the rules by which properties of a class scale; see `Facts.scales`.

    Args:
        cls: class of the schema.

    Returns:
        Rule by name of the property.
    """
    result: dict[str, str] = {}
    # Rules of derived classes override those of their bases.
    for base in reversed(cls.__mro__):
        facts = vars(base).get("facts")
        if isinstance(facts, Facts):
            result.update(facts.scales)
    return {name: rule for name, rule in result.items() if rule}


def scale_inertia(body: Body, factors: Array, *, scales_mass: bool) -> None:
    """Scale the mass and inertia of a body.

    If the factors differ, OpenSim treats the body as a cylinder along the axis of its smallest
    moment of inertia.

    Args:
        body: body to scale; it is changed in place.
        factors: scale factors along the axes of the body (3,).
        scales_mass: whether the mass grows with the volume.
    """
    mass = body.mass
    volume = abs(float(np.prod(factors)))
    xx, yy, zz, xy, xz, yz = body.inertia
    moments = np.array((xx, yy, zz))
    products = np.array((xy, xz, yz))
    if scales_mass:
        body.mass *= volume
    mass_ratio = volume if scales_mass else 1.0
    x, y, z = factors.tolist()
    if body.mass <= MASSLESS_KG:
        moments, products = np.zeros(3), np.zeros(3)
    elif _is_equal_factor(x, y) and _is_equal_factor(y, z):
        moments = moments * mass_ratio * (x * x)
        products = products * mass_ratio * (x * x)
    else:
        # A cylinder of the same mass and moments: I_axis = m r²/2, I_side = m (l²/12 + r²/4).
        axis = int(np.argmin(moments))
        side_axis = 1 if axis == 0 else 0
        radius = sqrt(max(2.0 * moments[axis] / mass, 0.0))
        length = (
            sqrt(max(12.0 * (moments[side_axis] - 0.25 * mass * radius * radius) / mass, 0.0))
            * factors[axis]
        )
        first_side_factor, second_side_factor = np.delete(factors, axis).tolist()
        square = radius * first_side_factor * radius * second_side_factor
        moments = np.full(3, body.mass * (length * length / 12.0 + 0.25 * square))
        moments[axis] = 0.5 * body.mass * square
        products = products * np.array((x * y, x * z, y * z)) * mass_ratio
    body.inertia = (*moments.tolist(), *products.tolist())


def _is_equal_factor(first: float, second: float) -> bool:
    """Return whether OpenSim treats two factors as equal."""
    return abs(first - second) <= FACTOR_TOLERANCE * max(abs(first), abs(second), 1.0)


class _Scaler:
    """Scaling of components by the factors of the bodies to which they are fixed."""

    def __init__(self, model: Model, factors: Factors, mechanism: Mechanism) -> None:
        self.tree = model.tree()
        self.placements = Placements(self.tree)
        self.factors = {
            name: np.array(axis_factors, dtype=float) for name, axis_factors in factors.items()
        }
        # Resolve all frames before scaling changes their offsets.
        for frame in model.components(PhysicalFrame):
            self.placements.resolve_frame(frame)
        self.mechanism = mechanism

    def get_base_factors(self, frame: PhysicalFrame) -> Array | None:
        """Return the factors of the body (or ground) to which a frame is fixed, or None."""
        base, _ = self.placements.resolve_frame(frame)
        return self.factors.get(base.rsplit("/", 1)[1])

    def scale_component(self, component: Component) -> None:
        """Scale the properties of a component that have a rule."""
        for name, rule in get_scale_rules(type(component)).items():
            frame_source, _, factor_choice = rule.partition(" ")
            if frame_source == PATH:
                continue
            if is_a(component, "CoordinateCouplerConstraint"):
                factors = self._get_coupler_factors(component, frame_source)
            elif frame_source == SELF:
                assert isinstance(component, PhysicalFrame)
                factors = self.get_base_factors(component)
            elif frame_source == HOLDER:
                factors = self.get_base_factors(self._find_holder(component))
            else:
                factors = self.get_base_factors(
                    self.placements.follow_socket(component, frame_source)
                )
            if factors is not None:
                setattr(
                    component,
                    name,
                    _multiply_value(
                        getattr(component, name), _select_factors(component, factors, factor_choice)
                    ),
                )

    def _find_holder(self, component: Component) -> PhysicalFrame:
        """Return the frame that contains a component."""
        # A frame holds itself.
        ancestor: Component | None = component
        while ancestor is not None and not isinstance(ancestor, PhysicalFrame):
            ancestor = self.tree.parent_of(ancestor)
        assert ancestor is not None
        return ancestor

    def _get_coupler_factors(self, coupler: Component, name: str) -> Array | None:
        """Return the factors for a coupler that determines a translation; None for a rotation.

        They are those of the parent of the joint that the translation belongs to.

        Raises:
            ModelError: these factors differ between the axes.
        """
        coordinate = self.tree.target(coupler, name, getattr(coupler, name))
        assert isinstance(coordinate, Coordinate)
        info = self.mechanism.coordinates[
            self.mechanism.coordinate_index(self.placements.path(coordinate))
        ]
        joint = self.tree.parent_of(coordinate)
        # Angles do not scale.
        if info.motion_type != "translational" or not isinstance(joint, Joint):
            return None
        factors = self.get_base_factors(self.placements.follow_socket(joint, "socket_parent_frame"))
        if factors is not None and len(set(factors.tolist())) > 1:
            raise ModelError(
                f"'{coupler.path}' determines a translation of the joint '{joint.path}', whose "
                "parent is scaled by "
                f"{' × '.join(f'{factor:.6g}' for factor in factors)}; use one factor for all its "
                "axes"
            )
        return factors


def _select_factors(component: Component, factors: Array, factor_choice: str) -> Array:
    """Return the factors that a rule names, or all three."""
    if factor_choice in ("x", "y", "z"):
        return factors["xyz".index(factor_choice)][None]
    if factor_choice == MEAN:
        return np.array((factors.sum() / 3.0,))
    if factor_choice not in (ALONG, ACROSS, AXES):
        return factors
    assert isinstance(component, WrapObject)
    axes = rotation_xyz(np.array(component.xyz_body_rotation, dtype=float))
    # Factors along the rotated axes of the wrap object.
    lengths = np.linalg.norm(axes * factors[:, None], axis=0)
    if factor_choice == AXES:
        return np.asarray(lengths)
    # Wrap cylinders lie along their z axes.
    return np.array((lengths[2] if factor_choice == ALONG else 0.5 * (lengths[0] + lengths[1]),))


def _multiply_value(value: Any, factors: Array) -> Any:
    """Return the value of a property multiplied by factors."""
    if isinstance(value, Function):
        return _multiply_function(value, float(factors[0]))
    if isinstance(value, SpatialTransform):
        for name in TRANSLATIONS:
            axis = getattr(value, name)
            # A translation that equals its coordinate is not a length of the model.
            if isinstance(axis.function, LinearFunction) and tuple(axis.function.coefficients) == (
                1.0,
                0.0,
            ):
                continue
            axis.function = _multiply_function(axis.function, float(np.abs(axis.axis) @ factors))
        return value
    if isinstance(value, list):
        for shape in value:
            shape.scale_factors = _multiply_value(shape.scale_factors, factors)
        return value
    if isinstance(value, tuple):
        return tuple(float(number * factor) for number, factor in zip(value, factors, strict=False))
    return None if value is None else float(value * factors[0])


def _multiply_function(function: Function, factor: float) -> MultiplierFunction:
    """Return a function multiplied by a factor."""
    if isinstance(function, MultiplierFunction):
        function.scale *= factor
        return function
    return MultiplierFunction(function=function, scale=factor)
