"""How findings speak of things."""

from __future__ import annotations

from collections.abc import Iterable

from osimlite.base.text import find_nearest, join_words
from osimlite.io.document.lexical import format_shortest
from osimlite.schema.base import Object, Unknown


def describe_object(item: Object) -> str:
    """``Body 'pelvis'``, or ``Body`` for one without a name."""
    kind = item.class_name if isinstance(item, Unknown) else type(item).tag
    return f"{kind} '{item.name}'" if item.name else kind


def with_article(noun: str) -> str:
    """The noun with its article."""
    return f"{'an' if noun[:1].lower() in 'aeiou' else 'a'} {noun}"


def format_quantity(value: float | tuple[float, ...], unit: str | None = None) -> str:
    """A number, or several, in few digits and with the unit."""
    values = value if isinstance(value, tuple) else (value,)
    text = " ".join(
        f"{item:.6g}" if item == item and abs(item) != float("inf") else format_shortest(item)
        for item in values
    )
    return f"{text} {unit}" if unit else text


def format_value(value: object) -> str:
    """A value as a file would have it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return format_quantity(value)
    if isinstance(value, tuple):
        return " ".join(map(format_value, value)) or "an empty list"
    return str(value) if value not in (None, "") else "nothing"


def find_nearest_name(text: str, right: list[str]) -> str | None:
    """The find_nearest right text; of paths the last names are compared, so that a long way there does not hide them."""
    whole = find_nearest(text, right, cutoff=70)
    last = text.rstrip("/").rpartition("/")[2]
    by_last = {word.rpartition("/")[2]: word for word in reversed(right)}
    near = find_nearest(last, by_last, cutoff=70)
    if near is None:
        return whole
    if whole is not None and whole.rpartition("/")[2] == near:
        return whole
    return by_last[near]


def suggest_names(wrong: Iterable[str], right: Iterable[str]) -> str:
    """What some texts may stand for, asked at the end of a sentence; nothing if no right one is like them."""
    known = sorted(right)
    near = [f"'{name}' for '{text}'" for text in wrong if (name := find_nearest_name(text, known))]
    return f"; is it {join_words(near)}?" if near else ""


def pick_closest(text: str, right: list[str]) -> str:
    """The one of some texts that is most like another."""
    return right[0] if len(right) == 1 else find_nearest(text, right, cutoff=0) or right[0]
