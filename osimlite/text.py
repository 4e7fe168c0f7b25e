"""Sentences for people: nearest names and short lists."""

from __future__ import annotations

from collections.abc import Iterable


def nearest(word: str, known: Iterable[str], *, cutoff: float = 60.0) -> str | None:
    """The known name most like `word` (case and a namespace before a colon ignored), or None if none is near."""
    from rapidfuzz import fuzz, process

    choices = list(known)
    for exact in (word, word.rpartition(":")[2]):
        but_for_case = [choice for choice in choices if choice.lower() == exact.lower()]
        if but_for_case:
            return but_for_case[0]
    found = process.extractOne(word, choices, scorer=fuzz.ratio, processor=str.lower, score_cutoff=cutoff)
    return found[0] if found else None


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """``"; did you mean 'x'?"``, or an empty text if nothing is near."""
    found = nearest(word, known)
    return f"; did you mean '{found}'?" if found else ""


def or_known(word: str, known: Iterable[str], *more: str) -> str:
    """``"; did you mean 'x'?"``, or if nothing is near all that there is: ``"; there is x, y and z"``."""
    choices = list(known)
    return did_you_mean(word, choices) or f"; there is {listed([*choices, *more])}"


def counted(number: int, noun: str) -> str:
    """``"1 step"``, ``"2 steps"``."""
    return f"{number} {noun}" + ("" if number == 1 else "s")


def listed(words: Iterable[str], *, most: int = 8) -> str:
    """``"a, b and c"``, cut after `most` words."""
    items = list(words)
    if len(items) > most:
        items = [*items[:most], f"{len(items) - most} more"]
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} and {items[-1]}"
