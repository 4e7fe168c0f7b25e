"""OSIM205 and following: readable numbers and words without a valid meaning."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.text import find_nearest, join_words
from osimlite.lint.registry import ERROR, FAILS, NAN, REFUSES, WARNING, FindingCollector, rule
from osimlite.lint.rules.functions import UNUSED, is_unused
from osimlite.lint.subject import Subject, cache_per_subject
from osimlite.lint.words import describe_object, format_quantity, format_value
from osimlite.schema import facts
from osimlite.schema.base import Object
from osimlite.schema.facts import REFUSED
from osimlite.schema.fields import Value, make_domain_test
from osimlite.schema.specs import FieldSpec, get_class_names, get_value_specs


def describe_consequence(
    cls: type[Object], name: str, number: float, *, rigid_tendon: bool = False
) -> tuple[str, bool]:
    """Return what OpenSim does with `number`, which is outside the domain of a property.

    A rigid tendon may have no length, where an elastic one needs some.

    Returns:
        The consequence, and whether it is a failure.
    """
    is_allowed = rigid_tendon and name == "tendon_slack_length"
    # A class may say more exactly than its base what happens, hence the order of resolution.
    for base in cls.__mro__:
        facts = base.__dict__.get("facts")
        if facts is None:
            continue
        # NaN stands for a missing value.
        case = (
            facts.missing
            if number != number
            else facts.zero
            if number == 0 and not is_allowed
            else {}
        )
        for consequences in (case, facts.outside, {REFUSED: facts.refused}):
            for consequence, properties in consequences.items():
                if name in properties.split():
                    return consequence, bool(consequence)
        if name in facts.doubtful:
            return facts.doubtful[name], False
    return "", False


@rule("OSIM205", "not-finite", severity=ERROR, consequences=(REFUSES, NAN))
def report_not_finite(subject: Subject, report: FindingCollector) -> None:
    """A number is NaN, or infinite where that is not allowed.

    Reports NaN in any number. Reports infinity everywhere except in bounds (ranges, smallest and
    largest controls), where it means that there is no limit.

    OpenSim accepts such a single number or vector without a message. Everything that is computed
    from it becomes NaN: the simulation runs to its end without a result. In a list, such as the
    points of a function or the `time_range` of inverse dynamics, OpenSim rejects the file. The
    finding is a warning in properties for drawing, in bounds, and in disabled forces and
    controllers: the motion is not affected.

    ```xml
    - <gravity>0 NaN 0</gravity>
    + <gravity>0 -9.80665 0</gravity>
    ```
    """
    for item, spec, value in _find_large_numbers(subject):
        # A missing mass has the default NaN in OpenSim, and a rule about it.
        if spec.tag == "mass" and value != value and subject.has_note(item, spec):
            continue
        # The default of an unreadable value has OSIM201 or OSIM202.
        if value == spec.default and subject.has_note(item, spec):
            continue
        # A default of NaN that the file does not set is no value of the file.
        if _has_nan(spec.default) and spec.name not in item.model_fields_set:
            continue
        non_finite = [
            number
            for number in _to_numbers(value)
            if math.isnan(number)
            or (
                math.isinf(number)
                # A range of times is infinite unless the file sets it.
                and (
                    (_is_older_list(spec.kind) and spec.name in item.model_fields_set)
                    or not _may_be_infinite(item, spec)
                )
            )
        ]
        if non_finite:
            consequence = _describe_nan_consequence(subject, item, spec, non_finite[0])
            report(
                f"{subject.describe_property(item, spec)} is {format_value(value)}: "
                f"{_describe_for_document(subject, consequence)}",
                item,
                tag=spec.tag,
                word=_find_word(subject, item, spec, non_finite[0]),
                consequence=_DECLARED_CONSEQUENCES.get(consequence),
                severity=WARNING if consequence in _MILD_CONSEQUENCES else None,
            )


def _describe_nan_consequence(
    subject: Subject, item: Object, spec: FieldSpec, number: float
) -> str:
    """Return what OpenSim 4.6 does with NaN or infinity in a property (measured)."""
    assert isinstance(spec.kind, Value)
    if _is_older_list(spec.kind):
        return _FILE_REFUSED
    if spec.tag == "gravity" or (spec.tag == "mass" and not number > 0.0):
        return REFUSED
    if not _DRAWN.isdisjoint(get_class_names(type(item))):
        return _DRAWN_CONSEQUENCE
    if _may_be_infinite(item, spec):
        return _BOUND_CONSEQUENCE
    if number != number and spec.name in _NAN_REFUSED.get(type(item).__name__, "").split():
        return REFUSED
    return UNUSED if is_unused(subject, item) else _NAN_CONSEQUENCE


def _describe_for_document(subject: Subject, consequence: str) -> str:
    """Return a consequence with the noun of the document in place of "the model", if it is another."""
    if subject.top is None or subject.model is not None:
        return consequence
    tag = type(subject.top).tag
    noun = "study" if tag == "MocoStudy" else "setup" if tag.endswith("Tool") else "file"
    return consequence.replace("rejects the model", f"rejects the {noun}")


def _is_older_list(kind: object) -> bool:
    """Return whether a property is a list of the first property system.

    It is the one case in which OpenSim rejects a file with NaN or infinity, even in a bound.
    """
    return isinstance(kind, Value) and kind.legacy and kind.shape == "list"


@rule("OSIM206", "impossible-value", severity=ERROR, consequences=(REFUSES, FAILS, NAN))
def report_impossible_value(subject: Subject, report: FindingCollector) -> None:
    """A number makes OpenSim fail or compute NaN.

    Reports numbers outside the valid range of their property, if OpenSim is known to reject them,
    to fail or to compute NaN. Examples are a contact stiffness of 0, a negative mass, and a
    CoordinateLimitForce with a `transition` of 0 or nearly 0.

    OpenSim gives no message for most of them. A contact stiffness of 0 gives 0/0 as soon as the
    surfaces touch.

    ```xml
      <CoordinateLimitForce name="stop">
          <coordinate>hip_flexion</coordinate> <upper_limit>90</upper_limit> <lower_limit>-25</lower_limit>
    -     <transition>0</transition>
    +     <transition>5</transition>
      </CoordinateLimitForce>
    ```
    """
    for item, spec, value, verdict in find_outside_domain(subject):
        if verdict.is_known:
            # Unknown consequences are reported by OSIM207.
            _report_domain(subject, report, item, spec, value, verdict)
    for item in subject.find_by_class("CoordinateLimitForce"):
        _report_lost_transition(subject, report, item)


def _report_lost_transition(subject: Subject, report: FindingCollector, force: Any) -> None:
    """Report a transition that a limit is too large to add to: OpenSim needs two different ends."""
    if not (math.isfinite(force.transition) and force.transition > 0.0):
        return
    for name, sign in (("upper_limit", 1.0), ("lower_limit", -1.0)):
        limit = getattr(force, name)
        # OpenSim converts limits of angles to radians, which may change how the sum is rounded.
        is_lost = all(
            scale * limit + sign * scale * force.transition == scale * limit
            for scale in (1.0, math.pi / 180.0)
        )
        if math.isfinite(limit) and is_lost:
            report(
                f"transition of {subject.describe_part(force)} is {force.transition:g}, "
                f"nearly 0 compared with its {name} of {limit:g}: OpenSim rejects the model",
                force,
                consequence=REFUSES,
                tag="transition",
            )


@rule("OSIM207", "doubtful-value", severity=WARNING, consequences=(FAILS, NAN))
def report_doubtful_value(subject: Subject, report: FindingCollector) -> None:
    """A number is outside the sensible range of its property.

    Reports numbers outside the valid range of their property, such as a negative radius or
    dissipation, or an opacity of 3. Also reports numbers of 1e20 and more (errors from 1e100), and
    positive sizes of 1e-20 and less (errors up to 1e-100). In damped Millard muscles it reports
    optimal fiber lengths below 1e-6 m (errors up to 3e-8 m).

    OpenSim computes with most of these numbers anyway. A negative dissipation adds energy in each
    impact, and a sphere with a negative radius touches nothing. Powers of numbers beyond 1e100 are
    infinite: OpenSim computes NaN, or fails.

    ```xml
    - <ContactSphere name="heel"> <socket_frame>/bodyset/shank</socket_frame> <radius>-0.05</radius> </ContactSphere>
    + <ContactSphere name="heel"> <socket_frame>/bodyset/shank</socket_frame> <radius>0.05</radius> </ContactSphere>
    ```
    """
    for item, spec, value, verdict in find_outside_domain(subject):
        if not verdict.is_known:
            _report_domain(subject, report, item, spec, value, verdict)
    for item, spec, value in _find_large_numbers(subject):
        huge = [number for number in _to_numbers(value) if HUGE <= abs(number) < math.inf]
        if huge and not _may_be_infinite(item, spec):
            # Tools have limits that no motion reaches.
            is_overflow = subject.model is not None and max(map(abs, huge)) >= OVERFLOW_LIMIT
            _report_size(subject, report, item, spec, huge[0], "large", is_error=is_overflow)
    for item, spec, value in [] if subject.model is None else _find_small_sizes(subject):
        _report_size(
            subject, report, item, spec, value, "small", is_error=value <= 1.0 / OVERFLOW_LIMIT
        )
    _report_short_fibers(subject, report)


def _report_short_fibers(subject: Subject, report: FindingCollector) -> None:
    """Report fibers of Millard muscles whose velocity OpenSim does not find.

    Newton's method for the velocity ends only if the fiber is damped and the tendon compliant;
    without one of them OpenSim has a formula.
    """
    for muscle in subject.find_by_class("Millard2012EquilibriumMuscle"):
        length = muscle.optimal_fiber_length
        if (
            not 1.0 / OVERFLOW_LIMIT < length < DOUBTFUL_FIBER
            or muscle.ignore_tendon_compliance
            or not muscle.fiber_damping > 0.0
        ):
            continue
        fails = length <= SHORTEST_FIBER
        report(
            f"optimal_fiber_length of {describe_object(muscle)} is {length:g} m: OpenSim "
            f"{'fails' if fails else 'may fail'} to find the velocity of such a short fiber",
            muscle,
            tag="optimal_fiber_length",
            consequence=FAILS,
            severity=ERROR if fails and not is_unused(subject, muscle) else None,
        )


def _report_size(
    subject: Subject,
    report: FindingCollector,
    item: Object,
    spec: FieldSpec,
    number: float,
    adjective: str,
    *,
    is_error: bool,
) -> None:
    """Report a number that is too large or too small."""
    value = item.__dict__[spec.name]
    power_note = (
        f"; powers of this number are {'infinite' if adjective == 'large' else 'zero'}"
        if is_error
        else ""
    )
    report(
        f"{subject.describe_property(item, spec)} is {format_value(value)}: no physical "
        f"quantity of a motion is this {adjective}{power_note}",
        item,
        tag=spec.tag,
        word=_find_word(subject, item, spec, number),
        severity=ERROR if is_error and not is_unused(subject, item) else None,
    )


@rule("OSIM208", "unknown-choice", severity=ERROR)
def report_unknown_choice(subject: Subject, report: FindingCollector) -> None:
    """A property has an unknown value.

    Reports words and numbers that are not in the list of values that OpenSim knows for a property.

    OpenSim uses one of the known values, or rejects the model.

    ```xml
      <ContactSphere name="heel"> <socket_frame>/bodyset/shank</socket_frame>
    -     <Appearance> <SurfaceProperties> <representation>7</representation> </SurfaceProperties> </Appearance>
    +     <Appearance> <SurfaceProperties> <representation>3</representation> </SurfaceProperties> </Appearance>
          <radius>0.05</radius> </ContactSphere>
    ```
    """
    for cls, items in subject.by_class.items():
        for spec in get_value_specs(cls):
            assert isinstance(spec.kind, Value)
            choices = spec.kind.choices
            if not choices:
                continue
            for item in items:
                value = getattr(item, spec.name)
                if spec.name not in item.model_fields_set or subject.has_note(item, spec):
                    continue
                # The word is marked only in a list; of a single value the complete text is marked.
                for word in value if isinstance(value, tuple) else (value,):
                    if word not in choices:
                        report(
                            f"{subject.describe_property(item, spec)} is '{word}', expected one "
                            f"of {join_words(map(str, choices))}",
                            item,
                            tag=spec.tag,
                            word=str(word) if isinstance(value, tuple) else None,
                            # Some properties take any letter case.
                            severity=WARNING if str(word).lower() in choices else None,
                            suggestion=find_nearest(str(word), map(str, choices)),
                        )


HUGE = 1e20
"""Number that no quantity of a motion reaches, in any unit."""


OVERFLOW_LIMIT = 1e100
"""Number above which third and fourth powers in formulas of muscles and contacts overflow."""

SHORTEST_FIBER = 3e-8
"""Optimal length (m) up to which no Millard muscle of 81 random ones in OpenSim 4.6 had a velocity."""

DOUBTFUL_FIBER = 1e-6
"""Optimal length (m) from which all of them had one."""

TINY = 1e-20
"""Number below which no size of a part of a body lies, in any unit."""


class DomainVerdict(NamedTuple):
    """Number outside its domain, with the domain and the (known or unknown) consequence."""

    number: float
    domain: str
    consequence: str
    is_known: bool


_NAN_CONSEQUENCE = "everything computed from it becomes NaN, without a message"
_DRAWN_CONSEQUENCE = "the object cannot be drawn"
_BOUND_CONSEQUENCE = "everything that uses this bound fails"
_FILE_REFUSED = "OpenSim rejects the file"
_DECLARED_CONSEQUENCES = {
    _FILE_REFUSED: REFUSES,
    REFUSED: REFUSES,
    _NAN_CONSEQUENCE: NAN,
    facts.NAN: NAN,
    facts.TOUCHING: NAN,
    facts.STOPS: FAILS,
    facts.STUCK: FAILS,
}
"""Consequences in OpenSim by the words of the messages."""
_NAN_REFUSED = {
    "PathSpring": "resting_length stiffness dissipation",
    "ClutchedPathSpring": "stiffness dissipation relaxation_time_constant initial_stretch",
    "Thelen2003Muscle": "FmaxTendonStrain FmaxMuscleStrain KshapeActive KshapePassive Af Flen "
    "fv_linear_extrap_threshold",
    "DeGrooteFregly2016Muscle": "activation_time_constant deactivation_time_constant fiber_damping "
    "default_activation default_normalized_tendon_force active_force_width_scale "
    "passive_fiber_strain_at_one_norm_force tendon_strain_at_one_norm_force "
    "activation_dynamics_smoothing",
}
"""Properties in which OpenSim 4.6 rejects NaN, even in a disabled force (measured), by class."""
_MILD_CONSEQUENCES = (_DRAWN_CONSEQUENCE, _BOUND_CONSEQUENCE, UNUSED)
_DRAWN = {
    "Geometry",
    "Appearance",
    "SurfaceProperties",
    "ModelDisplayHints",
    "ModelVisualPreferences",
}
"""Classes of objects that are only drawn."""


_OutsideDomain = tuple[Object, FieldSpec, Any, DomainVerdict]


@cache_per_subject
def find_outside_domain(subject: Subject) -> list[_OutsideDomain]:
    """Return every number outside its domain."""
    return list(_iterate_outside_domain(subject))


def _iterate_outside_domain(subject: Subject) -> Iterator[_OutsideDomain]:
    """Yield each property with a number outside its domain, and what OpenSim does with it."""
    # Paths wrap around them when the model is built, which needs a surface.
    obstacles = {
        id(subject.target_of(obstacle, "socket_contact_geometry"))
        for obstacle in subject.find_by_class("Scholz2015GeometryPathObstacle")
    }
    for cls, items in subject.by_class.items():
        # The class of the value is compared, since most values are plain floats and this loop meets
        # every number of a model.
        for spec, is_inside in _list_domains(cls):
            assert isinstance(spec.kind, Value)
            for item in items:
                value = item.__dict__[spec.name]
                if value is None or (value.__class__ is float and is_inside(value)):
                    # Infinity and NaN have the rule OSIM205.
                    continue
                outside_numbers = [
                    number
                    for number in _to_numbers(value)
                    if not is_inside(number) and math.isfinite(number)
                ]
                if not outside_numbers and _is_missing(item, spec, value):
                    consequence, fails = describe_consequence(cls, spec.name, math.nan)
                    if fails:
                        yield item, spec, value, DomainVerdict(math.nan, "", consequence, fails)
                    continue
                # The reader noted that the text was not read and the default was used; that default
                # is not the author's.
                if not outside_numbers or (
                    subject.has_note(item, spec)
                    and outside_numbers == list(_to_numbers(spec.default))
                ):
                    continue
                if id(item) in obstacles:
                    consequence, fails = _describe_obstacle_size(spec.name, outside_numbers)
                else:
                    rigid = bool(getattr(item, "ignore_tendon_compliance", False))
                    consequence, fails = describe_consequence(
                        cls, spec.name, outside_numbers[0], rigid_tendon=rigid
                    )
                domain = _get_domain(cls, spec)
                yield (
                    item,
                    spec,
                    value,
                    DomainVerdict(outside_numbers[0], domain, consequence, fails),
                )


def _describe_obstacle_size(name: str, numbers: Sequence[float]) -> tuple[str, bool]:
    """Return what OpenSim 4.6 does with sizes of an obstacle of a path that are not positive (measured).

    Returns:
        The consequence, and whether it is a failure.
    """
    if name == "torus_radius":
        return (REFUSED, True) if min(numbers) < 0.0 else ("the torus becomes a sphere", False)
    if name == "radius":
        # Whether OpenSim starts with a radius of 0 depends on the rest of the model.
        meaning = "the path around it has no meaning"
        return (
            (f"{meaning}, or OpenSim rejects the model", True)
            if 0.0 in numbers
            else (meaning, False)
        )
    if 0.0 in numbers:
        return REFUSED, True
    return "OpenSim takes the absolute value", False


def _is_missing(item: Object, spec: FieldSpec, value: Any) -> bool:
    """Return whether a file lacks a property without default. The mass of a body has a separate rule."""
    return spec.tag != "mass" and spec.name not in item.model_fields_set and _has_nan(value)


def _report_domain(
    subject: Subject,
    report: FindingCollector,
    item: Object,
    spec: FieldSpec,
    value: Any,
    verdict: DomainVerdict,
) -> None:
    """Report a number outside its domain, or one that is missing."""
    is_explicit = spec.name in item.model_fields_set
    assert isinstance(spec.kind, Value)
    if verdict.number != verdict.number:
        report(
            f"{subject.describe_property(item, spec)} is missing and has no default: "
            f"{_describe_for_document(subject, verdict.consequence)}",
            item,
            consequence=_DECLARED_CONSEQUENCES.get(verdict.consequence),
            tag=spec.tag,
        )
        return
    size = (
        format_quantity(value, spec.kind.unit)
        if is_explicit
        else f"not given (default {format_quantity(value, spec.kind.unit)})"
    )
    # Domains are written as comparisons with all digits; the message needs words and few digits.
    rounded = re.sub(r"\d\.\d{6,}(e-?\d+)?", lambda match: f"{float(match[0]):.6g}", verdict.domain)
    domain_text = (
        re.sub(r"^>= (\S+)$", r"\1 or more", rounded)
        .replace(">", "more than")
        .replace("!=", "a number other than")
    )
    consequence = (
        f": {_describe_for_document(subject, verdict.consequence)}" if verdict.consequence else ""
    )
    report(
        f"{subject.describe_property(item, spec)} is {size}, expected {domain_text}{consequence}",
        item,
        consequence=_DECLARED_CONSEQUENCES.get(verdict.consequence),
        tag=spec.tag,
        word=_find_word(subject, item, spec, verdict.number),
    )


def _get_domain(cls: type[Object], spec: FieldSpec) -> str:
    """Return the domain of a property of a class; a class may widen that of its base."""
    assert isinstance(spec.kind, Value)
    # Facts in the class itself, not inherited ones, replace the domain.
    return (
        cls.facts.domains.get(spec.name, spec.kind.domain)
        if "facts" in cls.__dict__
        else spec.kind.domain
    )


@cache
def _list_domains(cls: type[Object]) -> tuple[tuple[FieldSpec, Callable[[float], bool]], ...]:
    """Return the properties of a class that have a domain, with the test for it."""
    result = []
    for spec in get_value_specs(cls):
        assert isinstance(spec.kind, Value)
        domain = _get_domain(cls, spec)
        if domain and spec.kind.scalar in ("double", "int"):
            result.append((spec, make_domain_test(domain)))
    return tuple(result)


def _find_small_sizes(subject: Subject) -> Iterator[tuple[Object, FieldSpec, float]]:
    """Yield every number that has to be positive and is smaller than any size."""
    for cls, items in subject.by_class.items():
        for spec, is_inside in _list_domains(cls):
            # A domain that excludes 0 and includes this number is one of sizes.
            if is_inside(0.0) or not is_inside(TINY):
                continue
            for item in items:
                value = item.__dict__[spec.name]
                if value.__class__ is float and 0.0 < value <= TINY:
                    yield item, spec, value


def _find_large_numbers(subject: Subject) -> Iterator[tuple[Object, FieldSpec, Any]]:
    """Yield every property that may hold a huge or non-finite number, by a quick test."""
    for cls, items in subject.by_class.items():
        specs = _list_real_properties(cls)
        for item in items:
            state = item.__dict__
            for spec, name in specs:
                value = state[name]
                if value.__class__ is float:
                    # One comparison excludes NaN as well: with NaN both are false, and the value is
                    # yielded.
                    if -HUGE < value < HUGE:
                        continue
                # The sum of a list is huge or NaN if one of its numbers is; sums that cancel are no
                # such numbers.
                elif not value or -HUGE < sum(value) < HUGE:
                    continue
                yield item, spec, value


@cache
def _list_real_properties(cls: type[Object]) -> tuple[tuple[FieldSpec, str], ...]:
    """Return the properties of a class that hold real numbers, each with its name."""
    specs = (
        spec
        for spec in get_value_specs(cls)
        if isinstance(spec.kind, Value) and spec.kind.scalar == "double"
    )
    return tuple((spec, spec.name) for spec in specs)


def _to_numbers(value: Any) -> tuple[float, ...]:
    return tuple(value) if isinstance(value, tuple) else () if value is None else (value,)


def _has_nan(value: Any) -> bool:
    return any(isinstance(number, float) and number != number for number in _to_numbers(value))


def _may_be_infinite(item: Object, spec: FieldSpec) -> bool:
    """Return whether infinity is allowed because it means that there is no bound."""
    # Times of an analysis may be infinite in both directions, which means from the start, or to the
    # end.
    if type(item).__name__ == "AnalyzeTool" and spec.tag.endswith("_time"):
        return True
    # A default of infinity says that the property has no bound unless it is set.
    if any(
        isinstance(number, float) and math.isinf(number) for number in _to_numbers(spec.default)
    ):
        return True
    return re.search(r"range|limit|(?:^|_)(?:min|max)(?:_|$)|bound", spec.tag) is not None


def _find_word(subject: Subject, item: Object, spec: FieldSpec, number: float) -> str | None:
    """Return the word of the text that a number was read from; None without one."""
    element = subject.element_of(item, spec.tag)
    if element is None or subject.source is None:
        return None
    span = subject.source.spans[element]
    for word in subject.source.text[span.tag_end : span.inner_end].split():
        try:
            value = float(word)
        except ValueError:
            continue
        # Texts differ from the printed number ("1e3" and "1000"), so the values are compared.
        if value == number or (value != value and number != number):
            return word
    return None
