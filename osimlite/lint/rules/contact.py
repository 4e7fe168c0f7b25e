"""OSIM32x: lists of contact geometry."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import Any

from osimlite.base.text import join_words
from osimlite.lint.registry import ERROR, INFO, RUNS, WARNING, FindingCollector, rule
from osimlite.lint.rules.references import find_broken_references
from osimlite.lint.skeleton import find_base
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object
from osimlite.schema.base import Component, Object, Unknown
from osimlite.schema.contact import ContactGeometry
from osimlite.schema.forces import Force
from osimlite.schema.specs import get_defaults, get_reference_specs
from osimlite.schema.tree import Use


@rule("OSIM321", "contact-without-partner", severity=WARNING)
def report_contact_without_partner(subject: Subject, report: FindingCollector) -> None:
    """A contact force has no pair of surfaces that can touch.

    Reports contact forces that list fewer than two contact geometries in all their parameter sets
    together. Also reports forces whose surfaces cannot touch: all are on one body, or OpenSim
    computes no contact between their shapes. A HuntCrossleyForce acts between two surfaces that are
    spheres, ellipsoids or half-spaces, but not between two half-spaces. An ElasticFoundationForce
    acts between a mesh and another mesh, a sphere or a half-space.

    Such a force never acts, and OpenSim gives no message.

    ```xml
      <HuntCrossleyForce::ContactParameters>
    -     <geometry>heel</geometry> <stiffness>1e6</stiffness>
    +     <geometry>heel floor</geometry> <stiffness>1e6</stiffness>
      </HuntCrossleyForce::ContactParameters>
    ```
    """
    for force, holders, uses in _find_contact_lists(subject):
        if len(uses) > 1:
            reason = _explain_missing_contact(subject, force, uses)
            if not reason:
                continue
            message = f"{describe_object(force)} lists {reason}: it never acts"
        else:
            surface_text = f"one surface, '{uses[0].text}'" if uses else "no contact geometry"
            message = f"{describe_object(force)} lists {surface_text}: it never acts"
        if holders:
            report(message, holders[0], tag="geometry")
        else:
            report(message, force)


_ROUND = frozenset(("ContactSphere", "ContactEllipsoid"))
_MESH_PARTNERS = frozenset(("ContactMesh", "ContactSphere", "ContactHalfSpace"))


def _can_meet(force: str, first: str, second: str) -> bool:
    """Return whether OpenSim 4.6 computes contact between two shapes (measured, all pairs)."""
    shapes = {first, second}
    if force == "ElasticFoundationForce":
        return "ContactMesh" in shapes and shapes <= _MESH_PARTNERS
    return not shapes.isdisjoint(_ROUND) and shapes <= _ROUND | {"ContactHalfSpace"}


def _explain_missing_contact(subject: Subject, force: Component, uses: list[Use]) -> str:
    """Return why no two of the surfaces of a force can meet; empty if some can, or it is not known."""
    kind = type(force).__name__
    if kind not in ("HuntCrossleyForce", "ElasticFoundationForce"):
        return ""
    surfaces = [subject.resolution(use).target for use in uses]
    resolved_surfaces = [surface for surface in surfaces if isinstance(surface, ContactGeometry)]
    bases = [
        find_base(subject, subject.target_of(surface, "socket_frame"))
        for surface in resolved_surfaces
    ]
    # An unresolved surface or frame may be the partner.
    if len(resolved_surfaces) != len(surfaces) or any(base is None for base in bases):
        return ""
    pairs = [*combinations(zip(resolved_surfaces, bases, strict=True), 2)]
    # Surfaces of one body do not move against each other.
    if all(first[1] is second[1] for first, second in pairs):
        return f"only surfaces of {describe_object(bases[0])}" if bases[0] is not None else ""
    if any(
        first[1] is not second[1]
        and _can_meet(kind, type(first[0]).__name__, type(second[0]).__name__)
        for first, second in pairs
    ):
        return ""
    shapes = join_words(
        [f"{type(surface).__name__} '{surface.name}'" for surface in resolved_surfaces], max_count=3
    )
    return f"{shapes}, between which OpenSim computes no contact"


@rule("OSIM322", "contact-listed-twice", severity=ERROR, consequences=(RUNS,))
def report_contact_listed_twice(subject: Subject, report: FindingCollector) -> None:
    """A contact force lists the same surface twice.

    Reports every repeated name of a contact geometry in the lists of one force.

    OpenSim counts the surface twice, and the force is doubled.

    ```xml
      <HuntCrossleyForce::ContactParameters>
    -     <geometry>heel heel floor</geometry> <stiffness>1e6</stiffness>
    +     <geometry>heel floor</geometry> <stiffness>1e6</stiffness>
      </HuntCrossleyForce::ContactParameters>
    ```
    """
    for force, _, uses in _find_contact_lists(subject):
        seen_targets: set[int] = set()
        word_counts: dict[tuple[int, str], int] = {}
        for use in uses:
            target = subject.resolution(use).target
            # The position in the list distinguishes equal words.
            nth = word_counts.get((id(use.holder), use.text), 0)
            word_counts[id(use.holder), use.text] = nth + 1
            if target is None:
                continue
            if id(target) in seen_targets:
                report(
                    f"{describe_object(force)} lists '{target.name}' again: OpenSim counts it "
                    "twice and the force is doubled",
                    use.holder,
                    tag=use.spec.tag,
                    word=use.text,
                    nth=nth,
                )
            seen_targets.add(id(target))


@rule("OSIM323", "unused-contact-geometry", severity=INFO)
def report_unused_contact_geometry(subject: Subject, report: FindingCollector) -> None:
    """A contact geometry is not used.

    Reports contact geometry that no force and no path refers to.

    Such a geometry has no effect. Often a force should list it.

    ```xml
      <ContactSphere name="toe"> <socket_frame>/bodyset/shank</socket_frame> <radius>0.02</radius> </ContactSphere>
      <HuntCrossleyForce::ContactParameters>
    -     <geometry>heel floor</geometry> <stiffness>1e6</stiffness>
    +     <geometry>heel toe floor</geometry> <stiffness>1e6</stiffness>
      </HuntCrossleyForce::ContactParameters>
    ```
    """
    surfaces = list(subject.find_instances(ContactGeometry))
    if not surfaces or subject.has_unknown:
        return
    if any(broken.use.reference.target in _SURFACES for broken in find_broken_references(subject)):
        # A misspelt name may mean any of them.
        return
    # A force that lacks a surface has a finding, and the unused surface may be the missing one.
    if any(len(uses) < 2 for _, _, uses in _find_contact_lists(subject)):
        return
    used_surfaces = {
        id(subject.resolution(use).target)
        for use in subject.uses
        if use.reference.target in _SURFACES
    }
    for surface in surfaces:
        if id(surface) not in used_surfaces:
            report(f"no force uses {describe_object(surface)}", surface, attribute="name")


_SURFACES = {"ContactGeometry", "ContactSphere", "ContactHalfSpace"}


def _find_contact_lists(subject: Subject) -> Iterator[tuple[Component, list[Object], list[Use]]]:
    """Yield each force with lists of contact geometry, its parameter objects, and its references."""
    forces: dict[int, tuple[Component, list[Object], list[Use]]] = {}
    for force in subject.find_instances(Force):
        if "contact_parameters" in get_defaults(type(force))[1]:
            parameters: Any = force
            if not isinstance(parameters.contact_parameters, Unknown):
                forces[id(force)] = (force, list(parameters.contact_parameters.objects), [])
    if not forces:
        return
    for use in subject.uses:
        if id(use.owner) in forces and use.reference.rule == "contactgeometry-path-or-name":
            forces[id(use.owner)][2].append(use)
    for owner, holders, uses in forces.values():
        lists = [
            holder
            for holder in holders
            if any(
                spec.reference.target == "ContactGeometry"
                for spec in get_reference_specs(type(holder))
            )
        ]
        yield owner, lists, uses
