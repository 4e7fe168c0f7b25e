"""Sentences for people: nearest names, short lists, and what a terminal or a log must not obey."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Container, Iterable
from itertools import chain, count

_COLOUR = r"\x1b\[[0-9;]*m"
# Bidirectional controls, the separators of lines, and halves of characters: what stands for a byte
# that is no UTF-8.
_UNSAFE = r"[\0-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]|\r(?!\n)"
# Workflow commands: GitHub obeys `::name::` at the start of a line; it, Azure and TeamCity obey
# `##name[` anywhere.
_COMMAND = r"(?:(?<=\n)|\A)[ \t\xa0\u1680\u2000-\u200a\u202f\u205f\u3000]*:(?=:)|#(?=#\w*\[)"
_OBEYED = re.compile(f"{_COLOUR}|{_UNSAFE}|{_COMMAND}")
# What is escaped in JSON: a character of two halves, a half without the other, anything else.
_HALF = re.compile(r"\\(?:ud[89ab]..\\ud[c-f]..|u(d[89a-f]..)|.)")


def visible(text: str) -> str:
    r"""The text in one line, all that prints nothing written out: ``\n``, ``\x1b``, ``\u202e``.

    A byte of a file name that is no UTF-8 is written as ``\xe9``. This is for people: it cannot be
    read back.
    """
    return (
        text if text.isprintable() else "".join(c if c.isprintable() else _escape(c) for c in text)
    )


def json_lines(data: object) -> str:
    r"""JSON as programs read it from a log or a pipe: ASCII, so that it passes everywhere, and of whole characters.

    A byte of a file name that is no UTF-8 is written as ``\xe9``, as :func:`visible` does: no
    string of JSON holds it.
    """
    from json import dumps

    text = dumps(data, indent=2)
    if "\\ud" in text:
        text = _HALF.sub(
            lambda found: f"\\{_escape(chr(int(found[1], 16)))}" if found[1] else found[0], text
        )
    # Where it goes through the log of a CI job, a string must not be taken for a command; `#`
    # stands in strings only.
    return text.replace("##", "#\\u0023").replace("\x7f", "\\u007f") + "\n"


def harmless(text: str, *, starts_line: bool = True) -> str:
    r"""Lines of text without anything that terminals or the logs of CI obey, but for colours, ``\n`` and ``\t``.

    Args:
        text: whole lines, or a part of one.
        starts_line: whether a line starts where the text does.
    """
    return _OBEYED.sub(lambda found: _written_out(found, starts_line), text)


def _written_out(found: re.Match[str], starts_line: bool) -> str:
    what = found[0]
    if len(what) == 1 and what not in ":#":
        return _escape(what)
    if what.endswith(":"):
        return what if not starts_line and found.start() == 0 else f"{what[:-1]}\\x3a"
    return what if what.startswith("\x1b") else "\\x23"


def _escape(character: str) -> str:
    if "\udc80" <= character <= "\udcff":
        return f"\\x{ord(character) - 0xDC00:02x}"
    return character.encode("unicode_escape").decode("ascii")


LONGEST = 600
"""Characters of a message; a plain sentence has fewer."""


def brief(message: str) -> str:
    """The message, without the middle of long values in it if it is long."""
    if len(message) > LONGEST:
        message = re.sub(r"(\S{60})\S{60,}(\S{20})", r"\1…\2", message)
    return message if len(message) <= LONGEST else f"{message[: LONGEST - 201]}…{message[-200:]}"


FEW_NAMES = 500
"""So many names are compared here: this takes a millisecond, the import of rapidfuzz six."""


def nearest(word: str, known: Iterable[str], *, cutoff: float = 60.0) -> str | None:
    """The known name most like `word` (case and a namespace before a colon ignored), or None if none is near.

    Args:
        word: what was written.
        known: the names; of several that are equally near the first one counts.
        cutoff: least similarity, %.
    """
    choices = list(known)
    for exact in (word, word.rpartition(":")[2]):
        but_for_case = [choice for choice in choices if choice.lower() == exact.lower()]
        if but_for_case:
            return but_for_case[0]
    if len(choices) <= FEW_NAMES:
        measure = measure_similarity(word.lower())
        best = max(choices, key=lambda choice: measure(choice.lower()), default=None)
        return best if best is not None and measure(best.lower()) >= cutoff else None
    from rapidfuzz import fuzz, process

    result = process.extractOne(
        word, choices, scorer=fuzz.ratio, processor=str.lower, score_cutoff=cutoff
    )
    return result[0] if result else None


def measure_similarity(word: str) -> Callable[[str], float]:
    """Return a function that measures how similar a text is to a word, in %, as `rapidfuzz.fuzz.ratio` does.

    That is twice the length of the longest common subsequence by the sum of both lengths. The
    length is computed for all characters of the word at once, each of which has a bit (Hyyrö 2004,
    "Bit-parallel LCS-length computation revisited").
    """
    bits: dict[str, int] = {}
    for place, character in enumerate(word):
        bits[character] = bits.get(character, 0) | 1 << place
    every = (1 << len(word)) - 1

    def measure(text: str) -> float:
        total = len(word) + len(text)
        unmatched = every
        for character in text:
            matching = unmatched & bits.get(character, 0)
            unmatched = (unmatched + matching | unmatched - matching) & every
        common = len(word) - unmatched.bit_count()
        # The same steps as of rapidfuzz, so that rounding decides alike.
        return 100.0 * (1.0 - (total - 2 * common) / total) if total else 100.0

    return measure


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """``"; did you mean 'x'?"``, or an empty text if nothing is near."""
    result = nearest(word, known)
    return f"; did you mean '{result}'?" if result else ""


def did_you_mean_path(name: str, paths: Collection[str]) -> str:
    """The same, where the name may be a part of a path: ``/jointset/knee/angle/value`` for ``angle``."""
    within = next((f"; did you mean '{path}'?" for path in paths if name in path.split("/")), "")
    return within or did_you_mean(name, paths)


def or_known(word: str, known: Iterable[str], *more: str) -> str:
    """``"; did you mean 'x'?"``, or if nothing is near all that there is: ``"; there is x, y and z"``."""
    choices = list(known)
    return did_you_mean(word, choices) or f"; there is {listed([*choices, *more])}"


def span(low: float, high: float, form: str) -> str:
    """``"0.1 to 0.5"``, ``"0.3"`` if both are written so, ``"-"`` for what is no number."""
    return (
        "-" if low != low else " to ".join(dict.fromkeys((format(low, form), format(high, form))))
    )


def counted(number: int, noun: str) -> str:
    """``"1 step"``, ``"2 steps"``, ``"2 bodies"``."""
    many = f"{noun[:-1]}ies" if noun.endswith("y") else f"{noun}s"
    return f"{number} {noun if number == 1 else many}"


def unused(name: str, taken: Container[str | None], first: int = 1) -> str:
    """The name itself, or with the first number behind it that makes it another than those that are taken."""
    return next(
        free for free in chain((name,), (f"{name}_{k}" for k in count(first))) if free not in taken
    )


def listed(words: Iterable[str], *, most: int = 8) -> str:
    """``"a, b and c"``, cut after `most` words."""
    items = list(words)
    if len(items) > most:
        items = [*items[:most], f"{len(items) - most} more"]
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} and {items[-1]}"
