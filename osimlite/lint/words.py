"""Names of objects, quantities and suggestions in messages."""

from __future__ import annotations

from collections.abc import Iterable

from osimlite.base.text import find_nearest, join_words
from osimlite.io.document.lexical import format_shortest
from osimlite.schema.base import Object, Unknown


def describe_object(item: Object) -> str:
    """Return class and name of an object, such as ``Body 'pelvis'``, or ``Body`` without a name."""
    kind = item.class_name if isinstance(item, Unknown) else type(item).tag
    return f"{kind} '{item.name}'" if item.name else kind


def add_article(noun: str) -> str:
    """Return the noun with its article."""
    return f"{'an' if noun[:1].lower() in 'aeiou' else 'a'} {noun}"


def format_quantity(value: float | tuple[float, ...], unit: str | None = None) -> str:
    """Format a number, or several, with few digits and the unit.

    Args:
        value: number or numbers.
        unit: unit; empty without one.

    Returns:
        The numbers with spaces between them, and the unit after them.
    """
    values = value if isinstance(value, tuple) else (value,)
    text = " ".join(
        f"{item:.6g}" if item == item and abs(item) != float("inf") else format_shortest(item)
        for item in values
    )
    return f"{text} {unit}" if unit else text


def format_value(value: object) -> str:
    """Format a value as a file would contain it.

    Returns:
        The text; ``nothing`` or ``an empty list`` for what a file would leave empty.
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return format_quantity(value)
    if isinstance(value, tuple):
        return " ".join(map(format_value, value)) or "an empty list"
    return str(value) if value not in (None, "") else "nothing"


def find_nearest_name(text: str, right: list[str]) -> str | None:
    """Return the nearest valid text; paths are compared by their last names. None if none is near.

    Args:
        text: wrong text.
        right: valid texts.
    """
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
    """Return a question with suggestions for wrong texts, to end a message; empty without suggestions.

    Args:
        wrong: wrong texts.
        right: valid texts.
    """
    known = sorted(right)
    near = [f"'{name}' for '{text}'" for text in wrong if (name := find_nearest_name(text, known))]
    return f"; is it {join_words(near)}?" if near else ""


def pick_closest(text: str, right: list[str]) -> str:
    """Return the text that is most similar to another.

    Args:
        text: the text.
        right: texts to choose from.
    """
    return right[0] if len(right) == 1 else find_nearest(text, right, cutoff=0) or right[0]
