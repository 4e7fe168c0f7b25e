"""Text for messages: suggestions, lists, counts, and escapes of control characters."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Container, Iterable
from itertools import chain, count

from osimlite.base.patterns import compile_later

_COLOUR = r"\x1b\[[0-9;]*m"
# Bidirectional controls, line separators, and lone surrogates, which stand for bytes that are not
# UTF-8.
_UNSAFE = r"[\0-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]|\r(?!\n)"
# Workflow commands: GitHub executes `::name::` at the start of a line; GitHub, Azure and TeamCity
# execute `##name[` anywhere.
_COMMAND = r"(?:(?<=\n)|\A)[ \t\xa0\u1680\u2000-\u200a\u202f\u205f\u3000]*:(?=:)|#(?=#\w*\[)"
_EXECUTED = compile_later(f"{_COLOUR}|{_UNSAFE}|{_COMMAND}")
# Escapes in JSON: a surrogate pair, a lone surrogate, or any other escape.
_JSON_ESCAPE = compile_later(r"\\(?:ud[89ab]..\\ud[c-f]..|u(d[89a-f]..)|.)")


def escape_unprintable(text: str) -> str:
    r"""Return a text in one line, with unprintable characters as escapes: ``\n``, ``\x1b``, ``\u202e``.

    A byte of a file name that is not UTF-8 is written as ``\xe9``. The result is for messages: it
    cannot be read back.
    """
    return (
        text
        if text.isprintable()
        else "".join(
            character if character.isprintable() else _escape_character(character)
            for character in text
        )
    )


def format_json(data: object) -> str:
    r"""Return data as indented JSON in ASCII, without lone surrogates, for logs and pipes.

    A byte of a file name that is not UTF-8 is written as ``\xe9``, as :func:`escape_unprintable`
    does, because strings of JSON cannot contain it.
    """
    from json import dumps

    text = dumps(data, indent=2)
    if "\\ud" in text:
        text = _JSON_ESCAPE.sub(
            lambda match: (
                f"\\{_escape_character(chr(int(match[1], 16)))}" if match[1] else match[0]
            ),
            text,
        )
    # The log of a CI job must not execute a string as a command; `#` occurs in strings only.
    return text.replace("##", "#\\u0023").replace("\x7f", "\\u007f") + "\n"


def escape_control_sequences(text: str, *, starts_line: bool = True) -> str:
    r"""Escape what terminals and logs of CI execute, except colours, ``\n`` and ``\t``.

    Args:
        text: complete lines, or a part of one.
        starts_line: whether the text begins at the start of a line.

    Returns:
        The text with escapes such as ``\x1b`` in their place.
    """
    return _EXECUTED.sub(lambda match: _escape_match(match, starts_line), text)


def _escape_match(match: re.Match[str], starts_line: bool) -> str:
    """Return the escape of a control character or of the first character of a command."""
    matched = match[0]
    if len(matched) == 1 and matched not in ":#":
        return _escape_character(matched)
    if matched.endswith(":"):
        return matched if not starts_line and match.start() == 0 else f"{matched[:-1]}\\x3a"
    return matched if matched.startswith("\x1b") else "\\x23"


def _escape_character(character: str) -> str:
    """Return the escape of a character; for a lone surrogate, the escape of its byte."""
    if "\udc80" <= character <= "\udcff":
        return f"\\x{ord(character) - 0xDC00:02x}"
    return character.encode("unicode_escape").decode("ascii")


MAX_MESSAGE_LENGTH = 600
"""Largest number of characters of a message; a plain sentence has fewer."""


def shorten_message(message: str) -> str:
    """Return a message; if it is too long, cut the middle of long values, then of the message."""
    if len(message) > MAX_MESSAGE_LENGTH:
        message = re.sub(r"(\S{60})\S{60,}(\S{20})", r"\1…\2", message)
    return (
        message
        if len(message) <= MAX_MESSAGE_LENGTH
        else f"{message[: MAX_MESSAGE_LENGTH - 201]}…{message[-200:]}"
    )


MAX_COMPARED_NAMES = 500
"""Largest number of names compared without rapidfuzz: that takes 1 ms, the import of rapidfuzz 6 ms."""


SAME_CLASS_SIMILARITY = 80.0
"""Similarity (%) above which an unknown class is taken for a misspelt one: names of classes have the
same endings, so that 'ScrewJoint' and 'FreeJoint' reach 74 %.
"""


def find_nearest(word: str, candidates: Iterable[str], *, cutoff: float = 60.0) -> str | None:
    """Return the known name that is most similar to `word`, or None if none is similar.

    Case and a namespace before a colon are ignored. Names of the same side of the body are
    preferred, see :func:`osimlite.base.sides.group_by_side`.

    Args:
        word: unknown name.
        candidates: known names; of equally similar ones the first is returned.
        cutoff: smallest similarity (%).
    """
    names = list(candidates)
    for exact in (word, word.rpartition(":")[2]):
        same_letters = [name for name in names if name.lower() == exact.lower()]
        if same_letters:
            return same_letters[0]
    # Most commands suggest nothing.
    from osimlite.base.sides import group_by_side

    for group in group_by_side(word, names):
        nearest = _find_most_similar(word, group, cutoff)
        if nearest is not None:
            return nearest
    return None


def _find_most_similar(word: str, names: list[str], cutoff: float) -> str | None:
    """Return the first of the names with the largest similarity, or None below the cutoff (%)."""
    if len(names) <= MAX_COMPARED_NAMES:
        measure = measure_similarity(word.lower())
        best = max(names, key=lambda name: measure(name.lower()), default=None)
        return best if best is not None and measure(best.lower()) >= cutoff else None
    from rapidfuzz import fuzz, process

    result = process.extractOne(
        word, names, scorer=fuzz.ratio, processor=str.lower, score_cutoff=cutoff
    )
    return result[0] if result else None


def measure_similarity(word: str) -> Callable[[str], float]:
    """Return a function that measures the similarity of a text to a word (%), as `rapidfuzz.fuzz.ratio`.

    The similarity is twice the length of the longest common subsequence divided by the sum of both
    lengths. Bit-parallel algorithm with one bit for each character of the word (Hyyrö 2004,
    "Bit-parallel LCS-length computation revisited").
    """
    masks: dict[str, int] = {}
    for index, character in enumerate(word):
        masks[character] = masks.get(character, 0) | 1 << index
    all_bits = (1 << len(word)) - 1

    def measure(text: str) -> float:
        total = len(word) + len(text)
        unmatched = all_bits
        for character in text:
            matching = unmatched & masks.get(character, 0)
            unmatched = (unmatched + matching | unmatched - matching) & all_bits
        common_count = len(word) - unmatched.bit_count()
        # The same operations as in rapidfuzz, so that rounding gives equal results.
        return 100.0 * (1.0 - (total - 2 * common_count) / total) if total else 100.0

    return measure


def suggest_name(word: str, candidates: Iterable[str], *, cutoff: float = 60.0) -> str:
    """Return ``"; did you mean 'x'?"``, or an empty text if no known name is similar.

    Args:
        word: unknown word.
        candidates: valid names.
        cutoff: smallest similarity (%).
    """
    result = find_nearest(word, candidates, cutoff=cutoff)
    return f"; did you mean '{result}'?" if result else ""


def suggest_path(name: str, paths: Collection[str]) -> str:
    """Suggest a path that contains a name (``/jointset/knee/angle/value`` for ``angle``) or is similar.

    Args:
        name: unknown name.
        paths: valid paths.

    Returns:
        The end of a message, ``"; did you mean ...?"``; empty if nothing is similar.
    """
    hint = next((f"; did you mean '{path}'?" for path in paths if name in path.split("/")), "")
    return hint or suggest_name(name, paths)


def suggest_or_list(word: str, candidates: Iterable[str], *more_candidates: str) -> str:
    """Return ``"; did you mean 'x'?"``, or ``"; expected x, y or z"`` if no known name is similar.

    Args:
        word: unknown word.
        candidates: valid names.
        more_candidates: further texts to list.
    """
    names = list(candidates)
    accepted_words = join_words([*names, *more_candidates], conjunction="or")
    return suggest_name(word, names) or (f"; expected {accepted_words}" if accepted_words else "")


def append_clause(message: str, clause: str, *, separator: str = ";") -> str:
    """Return a message with a further clause: ``"a; b"``, or ``"a? B"`` after a question.

    Args:
        message: sentence that may end with a suggestion or, if it comes from another library, with
            a full stop.
        clause: text after it, with a lower-case letter at the start unless it is a name.
        separator: ";" or ":", which follows a message that is no question.
    """
    if message.endswith("?"):
        return f"{message} {clause[:1].upper()}{clause[1:]}"
    end = "" if message.endswith("...") else "."
    return f"{message.removesuffix(end)}{separator} {clause}"


def format_range(low: float, high: float, form: str) -> str:
    """Return ``"0.1 to 0.5"``; ``"0.3"`` if both numbers are formatted equally, ``"-"`` for NaN.

    Args:
        low: lower number.
        high: upper number.
        form: format specification, such as ".3g".
    """
    return (
        "-" if low != low else " to ".join(dict.fromkeys((format(low, form), format(high, form))))
    )


def format_count(number: int, noun: str) -> str:
    """Return a number with a noun: ``"1 step"``, ``"2 steps"``, ``"2 bodies"``.

    Args:
        number: count of things.
        noun: noun in the singular.
    """
    plural = f"{noun[:-1]}ies" if noun.endswith("y") else f"{noun}s"
    return f"{number} {noun if number == 1 else plural}"


def format_time_span(start: float, end: float) -> str:
    """Return a span of times in words; ends at infinity are left out.

    Args:
        start: first time, s.
        end: last time, s.
    """
    if end == float("inf"):
        return f"after {start:g} s"
    return f"before {end:g} s" if start == float("-inf") else f"between {start:g} and {end:g} s"


def add_article(noun: str) -> str:
    """Return a noun with its indefinite article: ``"a Body"``, ``"an Ellipsoid"``.

    Args:
        noun: singular noun, for example the name of a class; also in brackets, as in ``"<Body>"``.
    """
    return f"{'an' if noun.lstrip('<').startswith(_VOWELS) else 'a'} {noun}"


_VOWELS = (*"AEIOaeio", "RRA", "Um", "ndarray")
"""Beginnings of words with the article "an"; a UniversalJoint needs "a"."""


def make_unique_name(name: str, used_names: Container[str | None], first_number: int = 1) -> str:
    """Return a name that is not taken: the name, or the name with the smallest number that makes it unique.

    Args:
        name: preferred name.
        used_names: names that exist.
        first_number: first number to try.
    """
    return next(
        candidate
        for candidate in chain((name,), (f"{name}_{k}" for k in count(first_number)))
        if candidate not in used_names
    )


def join_words(words: Iterable[str], *, max_count: int = 8, conjunction: str = "and") -> str:
    """Return words as ``"a, b and c"``; after the first `max_count` the number of the others.

    Args:
        words: words to join.
        max_count: largest number of words to list.
        conjunction: word before the last one.
    """
    texts = list(words)
    if len(texts) > max_count:
        texts = [*texts[:max_count], f"{len(texts) - max_count} more"]
    if len(texts) < 2:
        return "".join(texts)
    return f"{', '.join(texts[:-1])} {conjunction} {texts[-1]}"
