"""OSIM205 and on: numbers and words that can be read and make no sense."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any, NamedTuple

from osimlite.base.text import find_nearest, join_words
from osimlite.lint.registry import ERROR, WARNING, FindingSink, rule
from osimlite.lint.subject import Subject, once
from osimlite.lint.words import quantity, shown
from osimlite.schema.base import Object
from osimlite.schema.facts import REFUSED
from osimlite.schema.fields import Value, domain_test
from osimlite.schema.specs import FieldSpec, lineage, value_specs


def consequence(
    cls: type[Object], name: str, number: float, *, rigid_tendon: bool = False
) -> tuple[str, bool]:
    """What happens with `number`, outside its domain, in a property; and whether that is a failure.

    A rigid tendon may have no length, where an elastic one needs some.
    """
    is_allowed = rigid_tendon and name == "tendon_slack_length"
    for base in cls.__mro__:
        facts = base.__dict__.get("facts")
        if facts is None:
            continue
        case = (
            facts.missing
            if number != number
            else facts.zero
            if number == 0 and not is_allowed
            else {}
        )
        for fates in (case, facts.outside, {REFUSED: facts.refused}):
            for fate, properties in fates.items():
                if name in properties.split():
                    return fate, bool(fate)
        if name in facts.doubts:
            return facts.doubts[name], False
    return "", False


@rule("OSIM205", "not-finite", severity=ERROR)
def not_finite(subject: Subject, report: FindingSink) -> None:
    """A number is NaN, or infinite where that makes no sense.

    Reports NaN in any number, and infinity except in bounds (ranges, smallest and largest
    controls), where it is a way to say that there is none.

    OpenSim accepts a single number or a vector in silence, and everything that is computed with it
    becomes NaN: the simulation runs to its end without a message and without a result. It refuses
    to load a file with such a number in a list, as the points of a function are. In what is only
    drawn, and in bounds, it is a warning: the motion stays.

    ```xml
    - <gravity>0 NaN 0</gravity>
    + <gravity>0 -9.80665 0</gravity>
    ```
    """
    for item, spec, value in _reals(subject):
        if spec.tag == "mass" and value != value and subject.noted(item, spec):
            continue
        if _has_nan(spec.default) and spec.name not in item.model_fields_set:
            continue
        bad = [
            number
            for number in _numbers(value)
            if math.isnan(number) or (math.isinf(number) and not _bound(item, spec))
        ]
        if bad:
            fate = _fate_of_nan(item, spec, bad[0])
            report(
                f"{subject.titled(item, spec)} is {shown(value)}: {fate}",
                item,
                tag=spec.tag,
                word=_word_of(subject, item, spec, bad[0]),
                severity=WARNING if fate in (_DRAWN_FATE, _BOUND_FATE) else None,
            )


def _fate_of_nan(item: Object, spec: FieldSpec, number: float) -> str:
    """Return what OpenSim 4.6 does with NaN or infinity in a property (measured)."""
    assert isinstance(spec.kind, Value)
    if spec.kind.legacy and spec.kind.shape == "list":
        return "OpenSim refuses to load the file"
    if spec.tag == "gravity" or (spec.tag == "mass" and not number > 0.0):
        return "OpenSim refuses the model"
    if not _DRAWN.isdisjoint(lineage(type(item))):
        return _DRAWN_FATE
    return _BOUND_FATE if _bound(item, spec) else _NAN_FATE


@rule("OSIM206", "impossible-value", severity=ERROR)
def impossible_value(subject: Subject, report: FindingSink) -> None:
    """A number makes OpenSim fail or compute NaN.

    Reports values outside their domain of which it is known that OpenSim refuses them, or computes
    nonsense: contact stiffness 0, a negative mass, a limit without transition.

    Most of them pass in silence. A contact stiffness of 0 is 0/0 as soon as the surfaces touch.

    ```xml
      <CoordinateLimitForce name="stop">
          <coordinate>hip_flexion</coordinate> <upper_limit>90</upper_limit> <lower_limit>-25</lower_limit>
    -     <transition>0</transition>
    +     <transition>5</transition>
      </CoordinateLimitForce>
    ```
    """
    for item, spec, value, verdict in outside(subject):
        if verdict.known:
            _report_domain(subject, report, item, spec, value, verdict)


@rule("OSIM207", "doubtful-value", severity=WARNING)
def doubtful_value(subject: Subject, report: FindingSink) -> None:
    """A number is outside the values that make sense for its property.

    Reports numbers outside the domain that the property declares: a negative radius or dissipation,
    an opacity of 3; and numbers of 1e20 and more.

    OpenSim computes with it all the same: a negative dissipation feeds energy into each impact, and
    a sphere with a negative radius touches nothing.

    ```xml
    - <ContactSphere name="heel"> <socket_frame>/bodyset/shank</socket_frame> <radius>-0.05</radius> </ContactSphere>
    + <ContactSphere name="heel"> <socket_frame>/bodyset/shank</socket_frame> <radius>0.05</radius> </ContactSphere>
    ```
    """
    for item, spec, value, verdict in outside(subject):
        if not verdict.known:
            _report_domain(subject, report, item, spec, value, verdict)
    for item, spec, value in _reals(subject):
        huge = [number for number in _numbers(value) if HUGE <= abs(number) < math.inf]
        if huge and not _bound(item, spec):
            report(
                f"{subject.titled(item, spec)} is {shown(value)}: no quantity of a motion is of this size",
                item,
                tag=spec.tag,
                word=_word_of(subject, item, spec, huge[0]),
            )


@rule("OSIM208", "unknown-choice", severity=ERROR)
def unknown_choice(subject: Subject, report: FindingSink) -> None:
    """A property has a value other than those that mean something.

    Reports words and numbers outside the list of those that OpenSim knows for a property.

    OpenSim takes one of the others, or refuses the model.

    ```xml
      <ContactSphere name="heel"> <socket_frame>/bodyset/shank</socket_frame>
    -     <Appearance> <SurfaceProperties> <representation>7</representation> </SurfaceProperties> </Appearance>
    +     <Appearance> <SurfaceProperties> <representation>3</representation> </SurfaceProperties> </Appearance>
          <radius>0.05</radius> </ContactSphere>
    ```
    """
    for cls, items in subject.by_class.items():
        for spec in value_specs(cls):
            assert isinstance(spec.kind, Value)
            choices = spec.kind.choices
            if not choices:
                continue
            for item in items:
                value = getattr(item, spec.name)
                if spec.name not in item.model_fields_set or subject.noted(item, spec):
                    continue
                for word in value if isinstance(value, tuple) else (value,):
                    if word not in choices:
                        report(
                            f"{subject.titled(item, spec)} is '{word}'; OpenSim knows {join_words(map(str, choices))}",
                            item,
                            tag=spec.tag,
                            word=str(word) if isinstance(value, tuple) else None,
                            # Some properties take any letter case.
                            severity=WARNING if str(word).lower() in choices else None,
                            suggestion=find_nearest(str(word), map(str, choices)),
                        )


HUGE = 1e20
"""No quantity of a motion, in whatever unit, is as large."""


class Verdict(NamedTuple):
    """A number outside its domain: the number, the domain, what OpenSim makes of it, and whether that is known."""

    number: float
    domain: str
    fate: str
    known: bool


_NAN_FATE = "what is computed with it becomes NaN, without a message"
_DRAWN_FATE = "it cannot be drawn"
_BOUND_FATE = "what takes it as a bound fails"
_DRAWN = {
    "Geometry",
    "Appearance",
    "SurfaceProperties",
    "ModelDisplayHints",
    "ModelVisualPreferences",
}
"""Classes of what is only drawn."""


_Outside = tuple[Object, FieldSpec, Any, Verdict]


@once
def outside(subject: Subject) -> list[_Outside]:
    """Every number outside its domain."""
    return list(_find_outside(subject))


def _find_outside(subject: Subject) -> Iterator[_Outside]:
    # A path is laid around them at once, which needs a surface.
    obstacles = {
        id(subject.target_of(obstacle, "socket_contact_geometry"))
        for obstacle in subject.named("Scholz2015GeometryPathObstacle")
    }
    for cls, items in subject.by_class.items():
        for spec, inside in _domains(cls):
            assert isinstance(spec.kind, Value)
            for item in items:
                value = item.__dict__[spec.name]
                if value is None or (value.__class__ is float and inside(value)):
                    continue
                wrong = [
                    number
                    for number in _numbers(value)
                    if not inside(number) and math.isfinite(number)
                ]
                if not wrong and _is_missing(item, spec, value):
                    fate, fails = consequence(cls, spec.name, math.nan)
                    if fails:
                        yield item, spec, value, Verdict(math.nan, "", fate, fails)
                    continue
                if not wrong or (
                    subject.noted(item, spec) and wrong == list(_numbers(spec.default))
                ):
                    continue
                if id(item) in obstacles and (spec.name, wrong[0]) != ("torus_radius", 0):
                    fate, fails = REFUSED, True
                else:
                    rigid = bool(getattr(item, "ignore_tendon_compliance", False))
                    fate, fails = consequence(cls, spec.name, wrong[0], rigid_tendon=rigid)
                domain = _domain(cls, spec)
                yield item, spec, value, Verdict(wrong[0], domain, fate, fails)


def _is_missing(item: Object, spec: FieldSpec, value: Any) -> bool:
    """Whether a file does not give what has no default. The mass of a body has a rule of its own."""
    return spec.tag != "mass" and spec.name not in item.model_fields_set and _has_nan(value)


def _report_domain(
    subject: Subject,
    report: FindingSink,
    item: Object,
    spec: FieldSpec,
    value: Any,
    verdict: Verdict,
) -> None:
    given = spec.name in item.model_fields_set
    assert isinstance(spec.kind, Value)
    if verdict.number != verdict.number:
        report(
            f"{subject.titled(item, spec)} is not given and has no default: {verdict.fate}",
            item,
            tag=spec.tag,
        )
        return
    size = (
        quantity(value, spec.kind.unit)
        if given
        else f"not given, so {quantity(value, spec.kind.unit)}"
    )
    wanted = (
        re.sub(r"^>= (\S+)$", r"\1 or more", verdict.domain)
        .replace(">", "more than")
        .replace("!=", "other than")
    )
    fate = f": {verdict.fate}" if verdict.fate else ""
    report(
        f"{subject.titled(item, spec)} is {size}, it should be {wanted}{fate}",
        item,
        tag=spec.tag,
        word=_word_of(subject, item, spec, verdict.number),
    )


def _domain(cls: type[Object], spec: FieldSpec) -> str:
    """The numbers that a property of a class may have; what a base has stricter is not so for it."""
    assert isinstance(spec.kind, Value)
    return (
        cls.facts.domains.get(spec.name, spec.kind.domain)
        if "facts" in cls.__dict__
        else spec.kind.domain
    )


@cache
def _domains(cls: type[Object]) -> tuple[tuple[FieldSpec, Callable[[float], bool]], ...]:
    """The properties of a class that have a domain, with the test for it."""
    result = []
    for spec in value_specs(cls):
        assert isinstance(spec.kind, Value)
        domain = _domain(cls, spec)
        if domain and spec.kind.scalar in ("double", "int"):
            result.append((spec, domain_test(domain)))
    return tuple(result)


def _reals(subject: Subject) -> Iterator[tuple[Object, FieldSpec, Any]]:
    """Every property that may hold a number that is huge or not finite: a quick test, since there are many numbers."""
    for cls, items in subject.by_class.items():
        specs = _numeric(cls)
        for item in items:
            state = item.__dict__
            for spec, name in specs:
                value = state[name]
                if value.__class__ is float:
                    if -HUGE < value < HUGE:
                        continue
                elif not value or -HUGE < sum(value) < HUGE:
                    continue
                yield item, spec, value


@cache
def _numeric(cls: type[Object]) -> tuple[tuple[FieldSpec, str], ...]:
    """The properties of a class that hold real numbers, each with its name."""
    specs = (
        spec
        for spec in value_specs(cls)
        if isinstance(spec.kind, Value) and spec.kind.scalar == "double"
    )
    return tuple((spec, spec.name) for spec in specs)


def _numbers(value: Any) -> tuple[float, ...]:
    return tuple(value) if isinstance(value, tuple) else () if value is None else (value,)


def _has_nan(value: Any) -> bool:
    return any(isinstance(number, float) and number != number for number in _numbers(value))


def _bound(item: Object, spec: FieldSpec) -> bool:
    """Whether infinity is a way to say that there is no bound."""
    if type(item).__name__ == "AnalyzeTool" and spec.tag.endswith("_time"):
        return True
    if any(isinstance(number, float) and math.isinf(number) for number in _numbers(spec.default)):
        return True
    return re.search(r"range|limit|(?:^|_)(?:min|max)(?:_|$)|bound", spec.tag) is not None


def _word_of(subject: Subject, item: Object, spec: FieldSpec, number: float) -> str | None:
    """The word of the text that a number was read from."""
    element = subject.element_of(item, spec.tag)
    if element is None or subject.source is None:
        return None
    span = subject.source.spans[element]
    for word in subject.source.text[span.tag_end : span.inner_end].split():
        try:
            value = float(word)
        except ValueError:
            continue
        if value == number or (value != value and number != number):
            return word
    return None
