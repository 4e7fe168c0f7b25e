"""OSIM2xx: numbers, switches and words that OpenSim drops or cuts, or that make no sense."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any, NamedTuple

from osimlite.document.lexical import Unclean, flag, real, whole
from osimlite.document.notes import Note
from osimlite.lint.engine import ERROR, WARNING, Found, rule
from osimlite.lint.fixes import replaced
from osimlite.lint.subject import Subject
from osimlite.lint.words import called, quantity, shown
from osimlite.schema.base import FieldSpec, Object, field_specs, value_specs
from osimlite.schema.fields import Value
from osimlite.text import listed, nearest


@rule("OSIM201", "unreadable-value", severity=ERROR)
def unreadable_value(subject: Subject, found: Found) -> None:
    """A value is no number, no switch, or not written as OpenSim reads it.

    ## What it does
    Reports text that OpenSim cannot read: words where a number belongs, `yes` for a switch, commas or brackets
    between the numbers of a vector.

    ## Why is this bad
    OpenSim writes a line to its log, drops the value and keeps the default. A locked coordinate comes loose, a
    contact sphere sits at the origin.

    ## Example
    ```xml
    <ContactSphere name="heel"> <socket_frame>/bodyset/shank</socket_frame> <location>0, -0.4, 0</location>
        <radius>0.05</radius> </ContactSphere>
    ```

    ## Use instead
    ```xml
    <ContactSphere name="heel"> <socket_frame>/bodyset/shank</socket_frame> <location>0 -0.4 0</location>
        <radius>0.05</radius> </ContactSphere>
    ```
    """
    for note, owner, spec, kind in _value_notes(subject, "unreadable", "ignored", "too-few", "too-many"):
        if note.kind.startswith("too-") and _all_read(note.word, kind):
            continue
        text = _text(owner, spec)
        found(
            f"{_property(subject, owner, spec)} is '{text}', not {kind.words()}: {_kept(note, owner, spec, kind)}",
            owner,
            number=note.number,
            word=note.word,
            suggestion=(better := _readable(text, kind)),
            fix=replaced(subject.source, subject.position(owner, tag=spec.tag), better) if "\n" not in text else None,
        )


@rule("OSIM202", "wrong-count", severity=ERROR)
def wrong_count(subject: Subject, found: Found) -> None:
    """A value has too many or too few numbers.

    ## What it does
    Reports vectors and lists with another count than the property has.

    ## Why is this bad
    Of too few numbers OpenSim keeps none and takes the default; of too many it takes the first ones, or none.

    ## Example
    ```xml
    <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02</inertia> </Body>
    ```

    ## Use instead
    ```xml
    <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    for note, owner, spec, kind in _value_notes(subject, "too-many", "too-few"):
        if not _all_read(note.word, kind):
            continue
        count = len(note.word.split())
        found(
            f"{_property(subject, owner, spec)} takes {kind.words()}, not {count}: {_kept(note, owner, spec, kind)}",
            owner,
            tag=spec.tag,
        )


@rule("OSIM203", "cut-number", severity=ERROR)
def cut_number(subject: Subject, found: Found) -> None:
    """OpenSim reads only the beginning of a number.

    ## What it does
    Reports numbers with something behind them: a decimal comma (`1,5`), a unit (`5kg`), a fraction (`1/3`), hexadecimal
    digits (`0x10`), Fortran's exponent (`1d3`).

    ## Why is this bad
    OpenSim takes the longest beginning that is a number and ignores the rest in silence: `1,5` is 1, `0x10` is 0.

    ## Example
    ```xml
    <Body name="thigh"> <mass>8,5</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```

    ## Use instead
    ```xml
    <Body name="thigh"> <mass>8.5</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    for note, owner, spec, _ in _value_notes(subject, "cut"):
        value = note.value[-1] if isinstance(note.value, tuple) and note.value else note.value
        ends = " and ends the list there" if isinstance(note.value, tuple) else ""
        found(
            f"{_property(subject, owner, spec)}: OpenSim reads '{note.word}' as {shown(value)}{ends}",
            owner,
            number=note.number,
            word=note.word,
            suggestion=(better := _whole_number(note.word)),
            fix=replaced(subject.source, subject.position(owner, tag=spec.tag, word=note.word), better, safe=False),
        )


@rule("OSIM204", "empty-value", severity=ERROR)
def empty_value(subject: Subject, found: Found) -> None:
    """An element that should hold a value is empty.

    ## What it does
    Reports empty numbers, vectors and switches. Properties that may be left out may also be empty.

    ## Why is this bad
    OpenSim writes a line to its log and keeps the default. The mass of a body has none: OpenSim refuses the model.

    ## Example
    ```xml
    <Body name="thigh"> <mass>8</mass> <mass_center></mass_center> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```

    ## Use instead
    ```xml
    <Body name="thigh"> <mass>8</mass> <mass_center>0 -0.2 0</mass_center> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    for note, owner, spec, kind in _value_notes(subject, "empty"):
        if kind.shape != "optional":
            found(
                f"{_property(subject, owner, spec)} is empty, not {kind.words()}: {_kept(note, owner, spec, kind)}",
                owner,
                number=note.number,
            )


@rule("OSIM205", "not-finite", severity=ERROR)
def not_finite(subject: Subject, found: Found) -> None:
    """A number is NaN, or infinite where that makes no sense.

    ## What it does
    Reports NaN in any number, and infinity except in bounds (ranges, smallest and largest controls), where it is
    a way to say that there is none.

    ## Why is this bad
    OpenSim accepts it in silence, and everything that is computed with the number becomes NaN: the simulation runs to
    its end without a message and without a result.

    ## Example
    ```xml
    <gravity>0 NaN 0</gravity>
    ```

    ## Use instead
    ```xml
    <gravity>0 -9.80665 0</gravity>
    ```
    """
    for item, spec in _reals(subject):
        value = getattr(item, spec.name)
        if spec.tag == "mass" and value != value and subject.noted(item, spec):
            continue
        if _has_nan(spec.default) and spec.name not in item.model_fields_set:
            continue
        bad = [number for number in _numbers(value) if math.isnan(number) or (math.isinf(number) and not _bound(spec))]
        if bad:
            fate = "OpenSim refuses the model" if _refuses_not_finite(item, spec, bad[0]) else _NAN_FATE
            found(
                f"{_property(subject, item, spec)} is {shown(value)}: {fate}",
                item,
                tag=spec.tag,
                word=_word_of(subject, item, spec, bad[0]),
            )


@rule("OSIM206", "impossible-value", severity=ERROR)
def impossible_value(subject: Subject, found: Found) -> None:
    """A number makes OpenSim fail or compute NaN.

    ## What it does
    Reports values outside their domain of which it is known that OpenSim refuses them, or computes nonsense: contact
    stiffness 0, a negative mass, a limit without transition.

    ## Why is this bad
    Most of them pass in silence. A contact stiffness of 0 is 0/0 as soon as the surfaces touch.

    ## Example
    ```xml
    <CoordinateLimitForce name="stop">
        <coordinate>hip_flexion</coordinate> <upper_limit>90</upper_limit> <lower_limit>-25</lower_limit>
        <transition>0</transition>
    </CoordinateLimitForce>
    ```

    ## Use instead
    ```xml
    <CoordinateLimitForce name="stop">
        <coordinate>hip_flexion</coordinate> <upper_limit>90</upper_limit> <lower_limit>-25</lower_limit>
        <transition>5</transition>
    </CoordinateLimitForce>
    ```
    """
    for item, spec, value, verdict in _outside(subject):
        if verdict.known:
            _report_domain(subject, found, item, spec, value, verdict)


@rule("OSIM207", "doubtful-value", severity=WARNING)
def doubtful_value(subject: Subject, found: Found) -> None:
    """A number is outside the values that make sense for its property.

    ## What it does
    Reports numbers outside the domain that the property declares: a negative radius or dissipation, an opacity of 3.

    ## Why is this bad
    OpenSim computes with it all the same: a negative dissipation feeds energy into each impact, and a sphere with a
    negative radius touches nothing.

    ## Example
    ```xml
    <ContactSphere name="heel"> <socket_frame>/bodyset/shank</socket_frame> <radius>-0.05</radius> </ContactSphere>
    ```

    ## Use instead
    ```xml
    <ContactSphere name="heel"> <socket_frame>/bodyset/shank</socket_frame> <radius>0.05</radius> </ContactSphere>
    ```
    """
    for item, spec, value, verdict in _outside(subject):
        if not verdict.known:
            _report_domain(subject, found, item, spec, value, verdict)


@rule("OSIM208", "unknown-choice", severity=ERROR)
def unknown_choice(subject: Subject, found: Found) -> None:
    """A property has a value other than those that mean something.

    ## What it does
    Reports words and numbers outside the list of those that OpenSim knows for a property.

    ## Why is this bad
    OpenSim takes one of the others, or refuses the model.

    ## Example
    ```xml
    <ContactSphere name="heel"> <socket_frame>/bodyset/shank</socket_frame>
        <Appearance> <SurfaceProperties> <representation>7</representation> </SurfaceProperties> </Appearance>
        <radius>0.05</radius> </ContactSphere>
    ```

    ## Use instead
    ```xml
    <ContactSphere name="heel"> <socket_frame>/bodyset/shank</socket_frame>
        <Appearance> <SurfaceProperties> <representation>3</representation> </SurfaceProperties> </Appearance>
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
                if spec.name in item.model_fields_set and value not in choices and not subject.noted(item, spec):
                    found(
                        f"{_property(subject, item, spec)} is '{value}'; OpenSim knows {listed(map(str, choices))}",
                        item,
                        tag=spec.tag,
                        suggestion=nearest(str(value), map(str, choices)),
                    )


class Verdict(NamedTuple):
    """A number outside its domain: the number, the domain, what OpenSim makes of it, and whether that is known."""

    number: float
    domain: str
    fate: str
    known: bool


_NAN_FATE = "what is computed with it becomes NaN, without a message"
_TOUCH = "forces and motion become NaN as soon as the surfaces touch"

_FATES: dict[tuple[str, str], tuple[Callable[[float], bool], str]] = {
    ("Body", "mass"): (lambda v: v < 0, "OpenSim refuses to load the file"),
    ("HuntCrossleyContactParameters", "stiffness"): (lambda v: v <= 0, _TOUCH),
    ("ElasticFoundationContactParameters", "stiffness"): (lambda v: v <= 0, _TOUCH),
    ("CoordinateLimitForce", "transition"): (lambda v: v == 0, "OpenSim refuses the model"),
    ("CoordinateLimitForce", "upper_stiffness"): (lambda v: v == 0, "the limit force is 0/0, the motion NaN"),
    ("CoordinateLimitForce", "lower_stiffness"): (lambda v: v == 0, "the limit force is 0/0, the motion NaN"),
}
"""What OpenSim 4.6 does with a number outside its domain, where it does not simply compute with it."""

_DOUBTS: dict[tuple[str, str], str] = {
    ("ContactSphere", "radius"): "it touches nothing",
    ("HuntCrossleyContactParameters", "dissipation"): "each impact adds energy",
    ("HuntCrossleyForce", "transition_velocity"): "friction no longer passes from rest to sliding",
    ("CoordinateLimitForce", "damping"): "the limit adds energy",
}


def _outside(subject: Subject) -> Iterator[tuple[Object, FieldSpec, Any, Verdict]]:
    for cls, items in subject.by_class.items():
        for spec, inside in _domains(cls):
            assert isinstance(spec.kind, Value)
            for item in items:
                value = item.__dict__[spec.name]
                if value is None or (value.__class__ is float and inside(value)):
                    continue
                wrong = [number for number in _numbers(value) if not inside(number) and math.isfinite(number)]
                if not wrong or (subject.noted(item, spec) and wrong == list(_numbers(spec.default))):
                    continue
                known, fate = _FATES.get((cls.__name__, spec.name), (None, ""))
                if known is not None and known(wrong[0]):
                    yield item, spec, value, Verdict(wrong[0], spec.kind.domain, fate, True)
                else:
                    doubt = _DOUBTS.get((cls.__name__, spec.name), "")
                    yield item, spec, value, Verdict(wrong[0], spec.kind.domain, doubt, False)


def _report_domain(subject: Subject, found: Found, item: Object, spec: FieldSpec, value: Any, verdict: Verdict) -> None:
    given = spec.name in item.model_fields_set
    assert isinstance(spec.kind, Value)
    size = quantity(value, spec.kind.unit) if given else f"not given, so {quantity(value, spec.kind.unit)}"
    wanted = verdict.domain.replace(">= 0", "0 or more").replace("> 0", "more than 0").replace("> 1", "more than 1")
    fate = f": {verdict.fate}" if verdict.fate else ""
    found(
        f"{_property(subject, item, spec)} is {size}, it should be {wanted}{fate}",
        item,
        tag=spec.tag,
        word=_word_of(subject, item, spec, verdict.number),
    )


@cache
def _domains(cls: type[Object]) -> tuple[tuple[FieldSpec, Callable[[float], bool]], ...]:
    """The properties of a class that have a domain, with the test for it."""
    found = []
    for spec in value_specs(cls):
        assert isinstance(spec.kind, Value)
        if spec.kind.domain and spec.kind.scalar in ("double", "int"):
            found.append((spec, _test(spec.kind.domain)))
    return tuple(found)


def _test(domain: str) -> Callable[[float], bool]:
    """The test that a domain such as ``"> 0"``, ``">= 1"`` or ``"0 to 1"`` stands for."""
    between = re.fullmatch(r"(\S+) to (\S+)", domain)
    if between:
        low, high = float(between[1]), float(between[2])
        return lambda value: low <= value <= high
    sign, _, bound = domain.partition(" ")
    limit = float(bound)
    return {
        ">": lambda value: value > limit,
        ">=": lambda value: value >= limit,
        "<": lambda value: value < limit,
        "<=": lambda value: value <= limit,
    }[sign]


def _reals(subject: Subject) -> Iterator[tuple[Object, FieldSpec]]:
    """Every property that holds a number that is not finite; a quick test first, since there are many numbers."""
    for cls, items in subject.by_class.items():
        specs = [s for s in value_specs(cls) if isinstance(s.kind, Value) and s.kind.scalar == "double"]
        for item in items:
            state = item.__dict__
            for spec in specs:
                value = state[spec.name]
                if value.__class__ is float:
                    if -math.inf < value < math.inf:
                        continue
                elif not value or all(-math.inf < number < math.inf for number in value):
                    continue
                yield item, spec


def _numbers(value: Any) -> tuple[float, ...]:
    return tuple(value) if isinstance(value, tuple) else () if value is None else (value,)


def _has_nan(value: Any) -> bool:
    return any(isinstance(number, float) and number != number for number in _numbers(value))


def _bound(spec: FieldSpec) -> bool:
    """Whether infinity is a way to say that there is no bound."""
    if any(isinstance(number, float) and math.isinf(number) for number in _numbers(spec.default)):
        return True
    return re.search(r"range|limit|(?:^|_)(?:min|max)(?:_|$)|bound", spec.tag) is not None


def _refuses_not_finite(item: Object, spec: FieldSpec, number: float) -> bool:
    return spec.tag == "gravity" or (spec.tag == "mass" and number != number)


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


def _value_notes(subject: Subject, *kinds: str) -> Iterator[tuple[Note, Object, FieldSpec, Value]]:
    # What is left of a value with elements inside means nothing.
    broken = {note.number for note in subject.notes if note.kind == "child-in-value"}
    for note in subject.notes:
        spec = note.spec
        if note.kind not in kinds or note.number in broken or note.owner is None or spec is None:
            continue
        if isinstance(spec.kind, Value):
            yield note, note.owner, spec, spec.kind


def _all_read(text: str, kind: Value) -> bool:
    """Whether every word is one of its kind, so that only their count is wrong."""
    readers: dict[str, Callable[[str], object]] = {"double": real, "int": whole, "bool": flag, "string": str}
    reads = readers[kind.scalar]
    try:
        for word in text.split():
            reads(word)
    except Unclean:
        return False
    return True


def _property(subject: Subject, owner: Object, spec: FieldSpec) -> str:
    """``mass of Body 'thigh'``."""
    if owner.name:
        return f"{spec.tag} of {called(owner)}"
    return f"{spec.tag} of {subject.called(owner)}"


def _text(owner: Object, spec: FieldSpec) -> str:
    raw = owner.layout.raw.get(spec.name) if owner.layout is not None else None
    return " ".join(raw[1].split()) if raw else ""


def _kept(note: Note, owner: Object, spec: FieldSpec, kind: Value) -> str:
    """What OpenSim goes on with."""
    if note.value is not None:
        return f"OpenSim takes {shown(note.value)}"
    if kind.legacy:
        return "OpenSim refuses to load the file"
    if spec.tag == "mass" and _has_nan(spec.default):
        return "without a mass OpenSim refuses to load the file"
    return f"OpenSim keeps the default, {shown(field_specs(type(owner))[spec.tag].default)}"


def _readable(text: str, kind: Value) -> str | None:
    """The same value as OpenSim would read it, if that is plain."""
    if kind.scalar == "bool":
        return {"yes": "true", "on": "true", "no": "false", "off": "false"}.get(text.lower())
    if kind.scalar == "double":
        words = re.sub(r"[,;()\[\]{}~]", " ", text).split()
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            return None
        if len(words) > 1 and (kind.size is None or len(numbers) == kind.size):
            return " ".join(words)
    return None


def _whole_number(word: str) -> str | None:
    """The number that was meant, if that is plain."""
    comma = re.fullmatch(r"([+-]?\d+),(\d+)", word)
    if comma:
        return f"{comma[1]}.{comma[2]}"
    if re.fullmatch(r"[+-]?[\d.]+[dD][+-]?\d+", word):
        return re.sub("[dD]", "e", word)
    if re.fullmatch(r"0[xX][0-9a-fA-F]+", word):
        return str(int(word, 16))
    unit = re.fullmatch(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?:[a-zA-Z]+|°|%)", word)
    return unit[1] if unit else None
