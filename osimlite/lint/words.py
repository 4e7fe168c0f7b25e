"""Names of objects, quantities and suggestions in messages."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from osimlite.base.text import find_nearest, join_words
from osimlite.io.document.lexical import format_shortest
from osimlite.schema.base import Object, Unknown


def describe_object(item: Object) -> str:
    """Return class and name of an object, such as ``Body 'pelvis'``, or ``Body`` without a name."""
    kind = item.class_name if isinstance(item, Unknown) else type(item).tag
    return f"{kind} '{item.name}'" if item.name else kind


def format_quantity(value: float | tuple[float, ...], unit: str | None = None) -> str:
    """Format a number, or several, with few digits and the unit.

    Args:
        value: number or numbers.
        unit: unit of the numbers; empty or None without one.

    Returns:
        The numbers with spaces between them, and the unit after them.
    """
    values = value if isinstance(value, tuple) else (value,)
    text = " ".join(
        f"{item:.6g}" if item == item and abs(item) != float("inf") else format_shortest(item)
        for item in values
    )
    if not unit:
        return text
    # Some properties have one unit for rotations and another for translations.
    units = unit.replace(" (rotational) | ", " or ").replace(" | ", " or ")
    return f"{text} {units.replace(' (rotational)', ' (for a rotation)')}"


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


def find_nearest_name(
    text: str, valid_texts: list[str], used_texts: Collection[str] = ()
) -> str | None:
    """Return the nearest valid text; paths are compared by their last names. None if none is near.

    Args:
        text: text that is not valid.
        valid_texts: candidates, among which the nearest is searched.
        used_texts: valid texts that are not suggested, because they are in use already. They are
            no reason to suggest a name of the other side of the body.
    """
    from osimlite.base.sides import group_by_side

    for group in group_by_side(text, valid_texts):
        unused_texts = [word for word in group if word not in used_texts]
        if (nearest := _find_nearest_in_group(text, unused_texts)) is not None:
            return nearest
        if len(unused_texts) < len(group) and _find_nearest_in_group(text, group) is not None:
            return None
    return None


def _find_nearest_in_group(text: str, valid_texts: list[str]) -> str | None:
    nearest_text = find_nearest(text, valid_texts, cutoff=70)
    last_name = text.rstrip("/").rpartition("/")[2]
    last_names = {word: word.rpartition("/")[2] for word in valid_texts}
    nearest_last_name = find_nearest(last_name, dict.fromkeys(last_names.values()), cutoff=70)
    if nearest_last_name is None or last_names.get(nearest_text or "") == nearest_last_name:
        return nearest_text
    same_name = [word for word in valid_texts if last_names[word] == nearest_last_name]
    return pick_closest(text, same_name)


def suggest_names(unknown_texts: Iterable[str], valid_texts: Iterable[str]) -> str:
    """Return a question with suggestions for wrong texts, to end a message; empty without suggestions.

    Args:
        unknown_texts: texts that are not valid.
        valid_texts: candidates for suggestions.
    """
    sorted_texts = sorted(valid_texts)
    suggestions = [
        f"'{name}' the same as '{text}'"
        for text in unknown_texts
        if (name := find_nearest_name(text, sorted_texts))
    ]
    return f"; is {join_words(suggestions)}?" if suggestions else ""


def pick_closest(text: str, candidates: list[str]) -> str:
    """Return the text that is most similar to another.

    Args:
        text: text to compare.
        candidates: texts to choose from.
    """
    return (
        candidates[0]
        if len(candidates) == 1
        else find_nearest(text, candidates, cutoff=0) or candidates[0]
    )
