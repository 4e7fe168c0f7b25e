"""OSIM50x: masses and inertias."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypedDict

from osimlite.lint.diagnostic import Fix
from osimlite.lint.fixes import replace_text
from osimlite.lint.inertia import compute_principal_axes, find_possible_inertia
from osimlite.lint.placement import locate_frame
from osimlite.lint.registry import (
    ERROR,
    INFO,
    NAN,
    REFUSES,
    WARNING,
    FindingCollector,
    Threshold,
    rule,
)
from osimlite.lint.skeleton import build_skeleton
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object, format_quantity
from osimlite.schema.frames import Body

SLACK = Threshold(
    "inertia-slack",
    1e-6,
    "",
    "relative error that is accepted in an inertia, because numbers in files are rounded",
)
GYRATION = Threshold(
    "largest-radius-of-gyration", 5.0, "m", "largest plausible radius of gyration of a body"
)
MASS = Threshold("largest-mass", 1000.0, "kg", "largest plausible mass of a body")
LEAST_COMPARED_MASS_KG = 1e-6
"""Least mass (kg) with which an inertia is compared; lighter bodies stand for rotors of motors."""


@rule("OSIM501", "missing-mass", severity=ERROR, consequences=(REFUSES,))
def report_missing_mass(subject: Subject, report: FindingCollector) -> None:
    """A body has no mass.

    Reports bodies without a `<mass>`.

    The default mass is NaN: OpenSim rejects the file.

    ```xml
    - <Body name="thigh"> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    + <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    mass = Body.field_specs()["mass"]
    for body in subject.find_instances(Body):
        if (
            body.mass != body.mass
            and "mass" not in body.model_fields_set
            # An unreadable mass is reported as that.
            and not subject.has_note(body, mass)
        ):
            report(f"{describe_object(body)} has no mass: OpenSim rejects the file", body)


@rule("OSIM502", "impossible-inertia", severity=WARNING, thresholds=(SLACK,), fixes="unsafe")
def report_impossible_inertia(subject: Subject, report: FindingCollector) -> None:
    """An inertia violates the triangle inequality.

    Reports inertias whose largest principal moment is larger than the sum of the other two, and by
    how many per cent.

    No distribution of mass has such an inertia, so the body cannot exist. OpenSim computes with it
    anyway: accelerations about the axis of the largest moment are too small. Often two numbers are
    swapped, or the inertia was scaled with a separate factor for each axis.

    ```xml
    - <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.5 0 0 0</inertia> </Body>
    + <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    slack = subject.config.value_of(SLACK)
    for body, moments in _list_inertias(subject):
        smallest, middle, large = moments
        # A negative moment has OSIM503.
        if smallest >= 0 and large > (smallest + middle) * (1 + slack):
            excess = 100 * (large / (smallest + middle) - 1) if smallest + middle > 0 else math.inf
            report(
                f"the inertia of {describe_object(body)} is impossible: its largest principal "
                f"moment, {format_quantity(large)}, is "
                + (f"{excess:.3g} % " if math.isfinite(excess) else "")
                + f"larger than the sum of the other two, {format_quantity(smallest + middle)}"
                + _describe_closest(body),
                body,
                tag="inertia",
                **_suggest_inertia(subject, body),
            )


@rule("OSIM503", "inertia-not-positive", severity=WARNING, thresholds=(SLACK,), fixes="unsafe")
def report_inertia_not_positive(subject: Subject, report: FindingCollector) -> None:
    """An inertia has a negative principal moment.

    Reports inertias that are negative about some axis: one of the moments is negative, or the
    products of inertia are too large for the moments.

    A torque about that axis accelerates the body in the opposite direction. OpenSim does not check
    the inertia: the simulation becomes unstable, or gives wrong results without a message.

    ```xml
    - <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0.3 0 0</inertia> </Body>
    + <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0.003 0 0</inertia> </Body>
    ```
    """
    slack = subject.config.value_of(SLACK)
    for body, moments in _list_inertias(subject):
        if moments[0] < -slack * max(map(abs, moments)):
            cause = (
                # Negative moments on the diagonal are seen; products that are too large are not.
                ""
                if min(body.inertia[:3]) < 0
                else "; its products of inertia are too large for its moments"
            )
            report(
                f"the inertia of {describe_object(body)} has a negative principal moment, {format_quantity(moments[0])}{cause}"
                + _describe_closest(body),
                body,
                tag="inertia",
                **_suggest_inertia(subject, body),
            )


@rule("OSIM504", "no-inertia", severity=WARNING, consequences=(NAN,))
def report_no_inertia(subject: Subject, report: FindingCollector) -> None:
    """A body has mass and no inertia.

    Reports bodies that have a mass, but an inertia that is zero or missing. As an info, the rule
    reports bodies that have an inertia but no mass: OpenSim sets their inertia to zero, and says so
    in its log.

    OpenSim treats the mass of the body as one point: nothing resists a rotation about this point.
    If the body is the last of its chain and its joint rotates it about this point, accelerations
    become NaN, and the finding is an error. Otherwise the integrator may take ever smaller steps.

    ```xml
    - <Body name="thigh"> <mass>8</mass> </Body>
    + <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    inertia = Body.field_specs()["inertia"]
    for body in subject.find_instances(Body):
        if body.mass == 0.0 and any(body.inertia) and not subject.has_note(body, inertia):
            report(
                f"{describe_object(body)} has an inertia but no mass: OpenSim sets the inertia to "
                "zero",
                body,
                tag="inertia",
                severity=INFO,
            )
        if body.mass > 0 and not any(body.inertia) and not subject.has_note(body, inertia):
            # The default of OpenSim is zero.
            state = "is zero" if "inertia" in body.model_fields_set else "is not given"
            spins = _spins_freely(subject, body)
            report(
                f"the inertia of {describe_object(body)} {state} though its mass is "
                f"{format_quantity(body.mass, 'kg')}"
                + (": nothing resists its joint, and accelerations become NaN" if spins else ""),
                body,
                tag="inertia",
                severity=ERROR if spins else None,
            )


def _spins_freely(subject: Subject, body: Body) -> bool:
    """Return whether a body without inertia at the end of its chain rotates about its mass center.

    A ball joint, or any that turns about three axes, always has an axis through the mass center.
    """
    links = build_skeleton(subject).find_joints(body)
    # Inside a chain the bodies beyond give inertia.
    if len(links) != 1 or links[0].child_base is not body:
        return False
    joint = links[0].joint
    location = locate_frame(subject, links[0].child)
    rotations = [motion for motion in joint.motion_types or () if motion == "rotational"]
    at_center = location is not None and location[1].position == body.mass_center
    return len(rotations) == 3 or bool(rotations and at_center)


@rule("OSIM523", "mass-out-of-proportion", severity=WARNING, thresholds=(MASS, GYRATION))
def report_mass_out_of_proportion(subject: Subject, report: FindingCollector) -> None:
    """A mass is implausibly large, or an inertia is implausibly large for its mass.

    Reports bodies heavier than a tonne. Also reports bodies whose radius of gyration is more than 5
    m: the square root of their largest moment of inertia divided by their mass. The mass would then
    have to lie several metres from the mass center. Bodies lighter than a milligram may have any
    inertia: they stand for the rotors of motors.

    Most often the unit is wrong: grams for kilograms, or kg mm^2 for kg m^2 (a million times as
    much). All forces of the model are then far too small to move its limbs.

    ```xml
    - <Body name="thigh"> <mass>8</mass> <inertia>100000 100000 20000 0 0 0</inertia> </Body>
    + <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    heaviest, widest = subject.config.value_of(MASS), subject.config.value_of(GYRATION)
    for body in subject.find_instances(Body):
        if heaviest < body.mass < math.inf:
            report(
                f"the mass of {describe_object(body)} is {format_quantity(body.mass, 'kg')}; is "
                "it in grams?",
                body,
                tag="mass",
                suggestion=f"{body.mass / 1000:.6g}",
            )
    for body, moments in _list_inertias(subject):
        # Without a mass the radius has no meaning.
        if not LEAST_COMPARED_MASS_KG < body.mass < math.inf:
            continue
        radius = math.sqrt(max(moments[2], 0) / body.mass)
        if radius > widest:
            report(
                f"with its inertia, all {format_quantity(body.mass, 'kg')} of {describe_object(body)} would "
                f"be {format_quantity(radius, 'm')} from the mass center; is the inertia in kg mm^2?",
                # kg mm^2 are 1e-6 kg m^2.
                body,
                tag="inertia",
                suggestion=" ".join(f"{number / 1e6:.6g}" for number in body.inertia),
            )


class _Suggestion(TypedDict):
    suggestion: str
    fix: Fix | None


def _describe_closest(body: Body) -> str:
    """Return a phrase about the nearest possible inertia and its distance."""
    nearest = find_possible_inertia(body.inertia)
    differences = [new - old for new, old in zip(nearest, body.inertia, strict=True)]
    # Each product stands in the matrix twice.
    distance, size = (math.hypot(*matrix, *matrix[3:]) for matrix in (differences, body.inertia))
    return (
        f"; the closest possible inertia, {' '.join(f'{number:.4g}' for number in nearest)}, "
        f"differs by {100 * distance / size:.2g} %"
    )


def _suggest_inertia(subject: Subject, body: Body) -> _Suggestion:
    """Return the nearest possible inertia as suggestion and fix."""
    text = " ".join(f"{number:.9g}" for number in find_possible_inertia(body.inertia))
    position = (
        subject.position(body, tag="inertia")
        if subject.element_of(body, "inertia") is not None
        else None
    )
    return {"suggestion": text, "fix": replace_text(subject.source, position, text, safe=False)}


def _list_inertias(subject: Subject) -> list[tuple[Body, Sequence[float]]]:
    """Return each body with a finite inertia other than zero, and its sorted principal moments."""
    return [
        (body, sorted(compute_principal_axes(body.inertia)[0]))
        for body in subject.find_instances(Body)
        if any(body.inertia) and all(map(math.isfinite, body.inertia))
    ]
