"""A model made larger or smaller: every property as its class declares that it scales, then masses and fiber lengths.

What scales by what is in the `facts` of the classes; the rules for inertias are those of OpenSim.
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
from osimlite.schema.constraint_types import CoordinateCouplerConstraint
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.custom_joint import SpatialTransform
from osimlite.schema.facts import ACROSS, ALONG, AXES, HOLDER, MEAN, OWN, PATH, Facts
from osimlite.schema.frames import Body, PhysicalFrame
from osimlite.schema.functions import Function, LinearFunction, MultiplierFunction
from osimlite.schema.joints import Joint
from osimlite.schema.model import Model
from osimlite.schema.wrapping import WrapObject

Factors = Mapping[str, Sequence[float]]
"""Factors along the x, y and z axes of bodies, by their names; those left out stay as they are."""

WEIGHTLESS = 2.0**-52
"""OpenSim takes a body of no more mass (kg) for one without."""
SAME = 2.0 ** (-52.0 * 7.0 / 8.0)
"""How nearly factors are equal that OpenSim takes for one."""
TRANSLATIONS = ("translation1", "translation2", "translation3")


def scale_model(
    model: Model,
    factors: Factors,
    mass: float = -1.0,
    *,
    preserve_mass_distribution: bool = False,
    mechanism: Mechanism | None = None,
) -> None:
    """Scale a model, as OpenSim's Model::scale does.

    Offsets of frames, stations, path points, wrap surfaces, mass centres and translations of joints
    go by the factors of the body that they are fixed to; optimal fiber, tendon slack and resting
    lengths by how much longer the whole path is in the default pose. Forces, stiffnesses, ranges of
    coordinates and contact geometry stay.

    Args: model: is changed. factors: of its bodies. mass: what all bodies together are to weigh,
        kg; if it is not positive that follows from the factors. preserve_mass_distribution: let the
        bodies keep their shares of the mass, instead of weighing more where they are larger.
        mechanism: of the model as it is; made if left out.

    Raises: ModelError: a coupler binds a translation to a body that is scaled in one direction more
        than in another. OsimliteError: the paths of the model cannot be computed.
    """
    mechanism = build_mechanism(model) if mechanism is None else mechanism
    before = path_lengths(model, mechanism)
    scaler = _Scaler(model, factors, mechanism)
    for component in scaler.tree.components:
        if not scaler.tree.is_internal(component):
            scaler.scale(component)
    for body in model.components(Body):
        own = scaler.of_base(body)
        if own is not None:
            scale_inertia(body, own, scales_mass=not preserve_mass_distribution)
    if mass > 0.0:
        total = sum(body.mass for body in model.components(Body))
        if total > 0.0:
            for body in model.components(Body):
                body.mass *= mass / total
                body.inertia = tuple(mass / total * item for item in body.inertia)  # type: ignore[assignment]
    after = path_lengths(model) if before else {}
    for path, length in before.items():
        if length > 0.0:
            owner = model[path]
            for name, rule in scales(type(owner)).items():
                if rule == PATH:
                    setattr(owner, name, getattr(owner, name) * (after[path] / length))


def path_lengths(model: Model, mechanism: Mechanism | None = None) -> dict[str, float]:
    """Length of each path in the default pose, m, by the component paths of their owners that have a rule for it."""
    owners = [item for item in model.components() if PATH in scales(type(item)).values()]
    if not owners:
        return {}
    from osimlite.simulation.paths import paths

    result = paths(model, mechanism=mechanism)
    lengths = result.lengths(result.mechanism.assemble({}))
    return {path: lengths[path] for path in (item.path for item in owners) if path in lengths}


@cache
def scales(cls: type[Any]) -> dict[str, str]:
    """What each property of a class is multiplied by when a model is scaled, see `Facts.scales`."""
    result: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        facts = vars(base).get("facts")
        if isinstance(facts, Facts):
            result.update(facts.scales)
    return {name: rule for name, rule in result.items() if rule}


def scale_inertia(body: Body, factors: Array, *, scales_mass: bool) -> None:
    """Give a body the mass and the inertia that it has once it is scaled.

    Where the factors differ, OpenSim takes the body for a cylinder along the axis of its least
    moment of inertia.
    """
    mass, volume = body.mass, abs(float(np.prod(factors)))
    xx, yy, zz, xy, xz, yz = body.inertia
    moments, products = np.array((xx, yy, zz)), np.array((xy, xz, yz))
    if scales_mass:
        body.mass *= volume
    denser = volume if scales_mass else 1.0
    x, y, z = factors.tolist()
    if body.mass <= WEIGHTLESS:
        moments, products = np.zeros(3), np.zeros(3)
    elif _same(x, y) and _same(y, z):
        moments, products = moments * denser * (x * x), products * denser * (x * x)
    else:
        axis = int(np.argmin(moments))
        side = 1 if axis == 0 else 0
        radius = sqrt(max(2.0 * moments[axis] / mass, 0.0))
        length = (
            sqrt(max(12.0 * (moments[side] - 0.25 * mass * radius * radius) / mass, 0.0))
            * factors[axis]
        )
        one, two = np.delete(factors, axis).tolist()
        square = radius * one * radius * two
        moments = np.full(3, body.mass * (length * length / 12.0 + 0.25 * square))
        moments[axis] = 0.5 * body.mass * square
        products = products * np.array((x * y, x * z, y * z)) * denser
    body.inertia = (*moments.tolist(), *products.tolist())


def _same(one: float, two: float) -> bool:
    return abs(one - two) <= SAME * max(abs(one), abs(two), 1.0)


class _Scaler:
    """Multiplies properties of components by the factors of the bodies that they are fixed to."""

    def __init__(self, model: Model, factors: Factors, mechanism: Mechanism) -> None:
        self.tree = model.tree()
        self.placements = Placements(self.tree)
        self.factors = {name: np.array(given, dtype=float) for name, given in factors.items()}
        # What frames lead to does not change while they are scaled.
        for frame in model.components(PhysicalFrame):
            self.placements.resolve_frame(frame)
        self.mechanism = mechanism

    def of_base(self, frame: PhysicalFrame) -> Array | None:
        """The factors of the body (or ground) that a frame is fixed to, None if that stays as it is."""
        base, _ = self.placements.resolve_frame(frame)
        return self.factors.get(base.rsplit("/", 1)[1])

    def scale(self, component: Component) -> None:
        """Scale the properties of a component for which its class has a rule."""
        for name, rule in scales(type(component)).items():
            whose, _, which = rule.partition(" ")
            if whose == PATH:
                continue
            if isinstance(component, CoordinateCouplerConstraint):
                factors = self._of_coupler(component, whose)
            elif whose == OWN:
                assert isinstance(component, PhysicalFrame)
                factors = self.of_base(component)
            elif whose == HOLDER:
                factors = self.of_base(self._holder(component))
            else:
                factors = self.of_base(self.placements.follow_socket(component, whose))
            if factors is not None:
                setattr(
                    component,
                    name,
                    _scaled(getattr(component, name), _chosen(component, factors, which)),
                )

    def _holder(self, component: Component) -> PhysicalFrame:
        """The frame in which a component is."""
        holder: Component | None = component
        while holder is not None and not isinstance(holder, PhysicalFrame):
            holder = self.tree.parent_of(holder)
        assert holder is not None
        return holder

    def _of_coupler(self, coupler: CoordinateCouplerConstraint, name: str) -> Array | None:
        """The factor of a coupler: that of the parent of the joint whose translation it gives; none of an angle."""
        coordinate = self.tree.target(coupler, name, getattr(coupler, name))
        assert isinstance(coordinate, Coordinate)
        info = self.mechanism.coordinates[
            self.mechanism.coordinate_index(self.placements.path(coordinate))
        ]
        joint = self.tree.parent_of(coordinate)
        if info.motion_type != "translational" or not isinstance(joint, Joint):
            return None
        factors = self.of_base(self.placements.follow_socket(joint, "socket_parent_frame"))
        if factors is not None and len(set(factors.tolist())) > 1:
            raise ModelError(
                f"'{coupler.path}' gives a translation of the joint '{joint.path}', whose parent is scaled by "
                f"{' × '.join(f'{factor:.6g}' for factor in factors)}; give it one factor for all axes"
            )
        return factors


def _chosen(component: Component, factors: Array, which: str) -> Array:
    """The factors that a rule names, or all three."""
    if which in ("x", "y", "z"):
        return factors["xyz".index(which)][None]
    if which == MEAN:
        return np.array((factors.sum() / 3.0,))
    if which not in (ALONG, ACROSS, AXES):
        return factors
    assert isinstance(component, WrapObject)
    axes = rotation_xyz(np.array(component.xyz_body_rotation, dtype=float))
    lengths = np.linalg.norm(axes * factors[:, None], axis=0)
    if which == AXES:
        return np.asarray(lengths)
    return np.array((lengths[2] if which == ALONG else 0.5 * (lengths[0] + lengths[1]),))


def _scaled(value: Any, factors: Array) -> Any:
    """A property multiplied by factors."""
    if isinstance(value, Function):
        return _multiplied(value, float(factors[0]))
    if isinstance(value, SpatialTransform):
        for name in TRANSLATIONS:
            axis = getattr(value, name)
            # An axis that moves as its coordinate does is no length.
            if isinstance(axis.function, LinearFunction) and tuple(axis.function.coefficients) == (
                1.0,
                0.0,
            ):
                continue
            axis.function = _multiplied(axis.function, float(np.abs(axis.axis) @ factors))
        return value
    if isinstance(value, list):
        for shape in value:
            shape.scale_factors = _scaled(shape.scale_factors, factors)
        return value
    if isinstance(value, tuple):
        return tuple(float(number * factor) for number, factor in zip(value, factors, strict=False))
    return None if value is None else float(value * factors[0])


def _multiplied(function: Function, factor: float) -> MultiplierFunction:
    """A function times a factor."""
    if isinstance(function, MultiplierFunction):
        function.scale *= factor
        return function
    return MultiplierFunction(function=function, scale=factor)
