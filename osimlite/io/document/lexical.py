"""Conversion between text and values by the lexical rules of OpenSim 4.6's reader and printer.

OpenSim reads the longest prefix of a text that is a number (``1,5`` is 1) and ignores what it cannot
read, without an error. The functions here read the same value, and raise :class:`UncleanText` with
it, so that the reader can note what was lost.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from functools import cache
from math import isfinite
from typing import Any, Literal

from osimlite.base.patterns import compile_later
from osimlite.schema.fields import FieldType, Reference, Value

Trouble = Literal["unreadable", "cut", "too-many", "too-few", "empty", "ignored"]

ABSENT: Any = object()
"""Value of a text for which OpenSim keeps the default."""

# Without `1`, which is true in the second property system of OpenSim and false in the first.
_PLAIN_FLAGS = {"true": True, "false": False, "0": False}

_PREFIX = compile_later(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_SPECIAL = {
    "nan": math.nan,
    "inf": math.inf,
    "infinity": math.inf,
    "+inf": math.inf,
    "+infinity": math.inf,
}
_SPECIAL |= {"-inf": -math.inf, "-infinity": -math.inf}


class UncleanText(Exception):
    """Text that is ambiguous or that OpenSim reads only in part.

    Attributes:
        value: value that OpenSim reads; ABSENT if it keeps the default.
        trouble: kind of the problem.
        word: part of the text with the problem.
    """

    def __init__(self, trouble: Trouble, word: str, value: Any = ABSENT) -> None:
        super().__init__(trouble)
        self.trouble: Trouble = trouble
        self.word = word
        self.value = value


def parse_real(word: str) -> float:
    """Return the number in a word as OpenSim reads it.

    Raises:
        UncleanText: only a part of the word, or nothing of it, is a number.
    """
    try:
        value = float(word)
        # Python also accepts underscores between digits and the digits of other scripts.
        if -math.inf < value < math.inf and "_" not in word and word.isascii():
            return value
    except ValueError:
        pass
    special = _SPECIAL.get(word.lower())
    if special is not None:
        return special
    prefix = _PREFIX.match(word)
    # OpenSim does not read a number with an exponent without digits, such as 1e.
    if (
        prefix is None
        or math.isinf(float(prefix[0]))
        or ("e" not in prefix[0].lower() and word[prefix.end()] in "eE")
    ):
        raise UncleanText("unreadable", word)
    raise UncleanText("cut", word, float(prefix[0]))


def parse_integer(word: str) -> int:
    """Return the whole number in a word; unlike after a real number, nothing may follow it.

    Raises:
        UncleanText: the word is not a whole number.
    """
    if re.fullmatch(r"[+-]?[0-9]+", word) is None:
        raise UncleanText("unreadable", word)
    return int(word)


def parse_flag(word: str) -> bool:
    """Return the truth value of a switch: true or false in any case, 1 or 0.

    Raises:
        UncleanText: the word is something else.
    """
    lowered = word.lower()
    if lowered in ("true", "1"):
        return True
    if lowered in ("false", "0"):
        return False
    raise UncleanText("unreadable", word)


def parse_legacy_flag(word: str) -> bool:
    """Return the truth value of a switch of the first property system.

    OpenSim reads everything but ``true`` as false there, also ``1``.

    Raises:
        UncleanText: the word is not ``true``, ``false`` or ``0``.
    """
    lowered = word.lower()
    if lowered not in _PLAIN_FLAGS:
        raise UncleanText("ignored", word, False)
    return _PLAIN_FLAGS[lowered]


def _parse_exact_flag(word: str) -> bool:
    """Return the truth value of a switch in a list of the first property system.

    OpenSim reads everything but lower-case ``true`` as false there.

    Raises:
        UncleanText: the word is not ``true``, ``false`` or ``0`` in lower case.
    """
    if word not in _PLAIN_FLAGS:
        raise UncleanText("ignored", word, False)
    return _PLAIN_FLAGS[word]


def _parse_complete_real(word: str) -> float:
    """Return the number in a word of a list of the first property system.

    OpenSim rejects a word there if only its beginning is a number.

    Raises:
        UncleanText: the word is not a number from end to end.
    """
    try:
        return parse_real(word)
    except UncleanText:
        raise UncleanText("unreadable", word) from None


def parse_text(raw: str) -> str:
    """Return a text with trimmed white space, and inner runs of it collapsed to one space."""
    return " ".join(split_words(raw))


def split_words(raw: str) -> list[str]:
    """Return the words of a text between ASCII white space.

    For OpenSim a no-break space is a letter.
    """
    return raw.split() if raw.isascii() else _OTHER.findall(raw)


_OTHER = compile_later(r"[^ \t\n\r\f\v]+")
_WORDS: dict[str, Callable[[str], Any]] = {
    "double": parse_real,
    "int": parse_integer,
    "bool": parse_flag,
    "string": str,
}


@cache
def make_converter(kind: FieldType) -> Callable[[str], Any]:
    """Return the function that reads the text of a property.

    The function raises :class:`UncleanText` where OpenSim reads something else without an error.
    """
    if isinstance(kind, Reference):
        return _make_list_converter(str, 0, None) if kind.shape == "list" else parse_text
    assert isinstance(kind, Value)
    word = parse_legacy_flag if kind.legacy and kind.scalar == "bool" else _WORDS[kind.scalar]
    if kind.shape in ("single", "optional"):
        return (
            parse_text
            if kind.scalar == "string"
            else _make_single_converter(word, kind.shape == "optional", kind.legacy)
        )
    if kind.size is not None:
        return _make_vector_converter(kind.size)
    if kind.shape == "vector":
        # At least one word: OpenSim keeps the default of a vector whose element is empty.
        return _make_list_converter(word, 1, None)
    if kind.legacy and kind.scalar != "string":
        return _make_legacy_converter(
            {"bool": _parse_exact_flag, "double": _parse_complete_real, "int": parse_integer}[
                kind.scalar
            ]
        )
    return _make_list_converter(word, kind.least, kind.most)


def is_read_as(raw: str, kind: FieldType, value: Any) -> bool:
    """Return whether the text of a property reads as a value without ambiguity.

    Args:
        raw: text of the property.
        kind: type of the property.
        value: expected value.
    """
    try:
        return bool(make_converter(kind)(raw) == value)
    except UncleanText:
        return False


def _make_single_converter(
    parse_word: Callable[[str], Any], optional: bool, legacy: bool
) -> Callable[[str], Any]:
    """Return a function that converts the text of a property with one value."""

    def convert(raw: str) -> Any:
        # Fast path: almost every text is one clean number or switch.
        if parse_word is parse_real:
            try:
                value = float(raw)
                if isfinite(value) and "_" not in raw and raw.isascii():
                    return value
            except ValueError:
                pass
        elif raw in _PLAIN_FLAGS and parse_word is not parse_integer:
            return _PLAIN_FLAGS[raw]
        words = split_words(raw)
        if not words:
            if optional:
                return None
            if parse_word is parse_legacy_flag:
                # OpenSim's first property system reads an empty switch as false.
                raise UncleanText("empty", "", False)
            raise UncleanText("empty", "")
        if len(words) == 1:
            return parse_word(words[0])
        if not legacy:
            # OpenSim reads all words before it uses the first, and keeps the default if it cannot
            # read one of them.
            _parse_words(words[1:], parse_word)
        raise UncleanText("too-many", raw.strip(), parse_word(words[0]))

    return convert


def _parse_words(
    words: list[str], parse_word: Callable[[str], Any]
) -> tuple[list[Any], UncleanText | None]:
    """Parse the words of a list one by one.

    Returns:
        Values of the words, and the error of the first word that OpenSim reads only in part or
        ignores; None without such a word.

    Raises:
        UncleanText: OpenSim cannot read a word at all.
    """
    values = []
    first = None
    for word in words:
        try:
            values.append(parse_word(word))
        except UncleanText as unclean:
            if unclean.value is ABSENT:
                raise
            values.append(unclean.value)
            first = first or unclean
    return values, first


def _make_vector_converter(size: int) -> Callable[[str], Any]:
    """Return a function that converts the text of a property with `size` numbers."""

    def convert(raw: str) -> Any:
        words = split_words(raw)
        try:
            values = tuple(map(float, words))
            # A sum is finite only if all numbers are, so that one test is enough.
            if len(values) == size and isfinite(sum(values)) and "_" not in raw and raw.isascii():
                return values
        except ValueError:
            pass
        if not words:
            raise UncleanText("empty", "")
        if len(words) < size:
            raise UncleanText("too-few", raw.strip())
        # OpenSim reads complete groups: of 6 numbers for 3 it takes the first group, while 4 are
        # unreadable and leave the default.
        if len(words) % size:
            raise UncleanText("too-many", raw.strip())
        cleanly, first = _parse_words(words, parse_real)
        if first is not None:
            raise UncleanText("unreadable", first.word, tuple(cleanly[:size]))
        if len(words) > size:
            raise UncleanText("too-many", raw.strip(), tuple(cleanly[:size]))
        return tuple(cleanly)

    return convert


def _make_list_converter(
    parse_word: Callable[[str], Any], min_count: int, max_count: int | None
) -> Callable[[str], Any]:
    """Return a function that converts the text of a property with a list of values."""

    def convert(raw: str) -> Any:
        words = split_words(raw)
        if (
            parse_word in (parse_real, _parse_complete_real)
            and min_count <= len(words)
            and (max_count is None or len(words) <= max_count)
        ):
            try:
                numbers = tuple(map(float, words))
                if isfinite(sum(numbers)) and "_" not in raw and raw.isascii():
                    return numbers
            except ValueError:
                pass
        values, first = (words, None) if parse_word is str else _parse_words(words, parse_word)
        if len(values) < min_count:
            raise UncleanText("too-few" if values else "empty", raw.strip())
        if first is not None:
            raise UncleanText(first.trouble, first.word, tuple(values[:max_count]))
        if max_count is not None and len(values) > max_count:
            raise UncleanText("too-many", raw.strip(), tuple(values[:max_count]))
        return tuple(values)

    return convert


def _make_legacy_converter(parse_word: Callable[[str], Any]) -> Callable[[str], Any]:
    """Return a converter for lists of the first property system.

    Words are separated by blanks or by commas, and a pair of brackets may surround them.
    """
    plain = _make_list_converter(parse_word, 0, None)

    def convert(raw: str) -> Any:
        if "," not in raw and raw.lstrip()[:1] not in ("(", "[", "{"):
            return plain(raw)
        stripped = raw.strip()
        if stripped[:1] + stripped[-1:] in ("()", "[]", "{}"):
            stripped = stripped[1:-1]
        if "," in stripped and any(len(split_words(word)) != 1 for word in stripped.split(",")):
            raise UncleanText("unreadable", raw.strip())
        return plain(stripped.replace(",", " "))

    return convert


def format_shortest(value: float) -> str:
    """Return the shortest decimal that reads back equal, with OpenSim's spelling of NaN and Inf."""
    if value == value and value not in (math.inf, -math.inf):
        words = repr(value)
        return words[:-2] if words.endswith(".0") else words
    return "NaN" if value != value else "Inf" if value > 0 else "-Inf"


def format_17_digits(value: float) -> str:
    """Return a number as text with 17 significant digits.

    OpenSim writes numbers in this form outside lists of the first property system.
    """
    if value == value and value not in (math.inf, -math.inf):
        return f"{value:.17g}"
    return format_shortest(value)


def format_6_digits(value: float) -> str:
    """Return a number as text with six digits if they read back equal, otherwise with 17.

    OpenSim itself writes six digits.
    """
    words = f"{value:g}"
    # A file that loses digits would not read back equal, which is worse than another spelling than
    # OpenSim's.
    return words if float(words) == value else format_17_digits(value)


def make_formatter(kind: FieldType, numbers: str) -> Callable[[Any], str]:
    """Return the function that formats values of a property.

    Args:
        kind: type of the property.
        numbers: ``"shortest"`` or ``"opensim"``.
    """
    return _build_formatter(kind, numbers == "opensim")


@cache
def _build_formatter(kind: FieldType, like_opensim: bool) -> Callable[[Any], str]:
    """Return a function that formats the value of a property as the text of its element."""
    if isinstance(kind, Reference):
        if kind.shape == "list":
            prefix = " " if kind.legacy else ""
            return lambda words: prefix + " ".join(words) if words else ""
        return str
    assert isinstance(kind, Value)
    if kind.scalar == "double":
        format_word: Callable[[Any], str] = format_17_digits if like_opensim else format_shortest
        # OpenSim prints lists of the first property system with six digits.
        if like_opensim and kind.legacy and kind.shape == "list":
            format_word = format_6_digits
    elif kind.scalar == "bool":
        format_word = _format_flag
    else:
        format_word = str
    if kind.shape in ("single", "optional"):
        return lambda value: "" if value is None else format_word(value)
    # OpenSim prints a blank after each switch of such a list, but before the other lists.
    if kind.legacy and kind.scalar == "bool":
        return lambda values: "".join(f"{format_word(value)} " for value in values)
    # OpenSim prints lists of the first property system with a leading blank.
    prefix = " " if kind.legacy else ""
    return lambda values: prefix + " ".join(map(format_word, values)) if values else ""


def _format_flag(value: bool) -> str:
    return "true" if value else "false"
