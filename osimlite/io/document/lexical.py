"""Text to value and back, by the lexical rules of OpenSim 4.6's reader and printer.

OpenSim takes the longest part of a text that is a number (``1,5`` is 1) and drops what it cannot
read without failing. The functions here read the same value, and raise :class:`UncleanText` with it, so
that the reader can note what was lost.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from functools import cache
from math import isfinite
from typing import Any, Literal

from osimlite.schema.fields import Kind, Reference, Value

Trouble = Literal["unreadable", "cut", "too-many", "too-few", "empty", "ignored"]

ABSENT: Any = object()
"""Stands for "OpenSim keeps the default"."""

_PLAIN_FLAGS = {"true": True, "false": False, "0": False}

_PREFIX = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_SPECIAL = {
    "nan": math.nan,
    "inf": math.inf,
    "infinity": math.inf,
    "+inf": math.inf,
    "+infinity": math.inf,
}
_SPECIAL |= {"-inf": -math.inf, "-infinity": -math.inf}


class UncleanText(Exception):
    """The text does not say what was meant, or says it in a way OpenSim cuts.

    Attributes:
        value: what OpenSim reads; ABSENT if it keeps the default.
        trouble: what is wrong.
        word: the part of the text concerned.
    """

    def __init__(self, trouble: Trouble, word: str, value: Any = ABSENT) -> None:
        super().__init__(trouble)
        self.trouble: Trouble = trouble
        self.word = word
        self.value = value


def parse_real(word: str) -> float:
    """One number as OpenSim reads it; Unclean if only a part of the word, or nothing, is a number."""
    try:
        value = float(word)
        # Python also takes an underscore between digits, and the digits of other scripts.
        if -math.inf < value < math.inf and "_" not in word and word.isascii():
            return value
    except ValueError:
        pass
    special = _SPECIAL.get(word.lower())
    if special is not None:
        return special
    prefix = _PREFIX.match(word)
    # Of an exponent without digits OpenSim makes nothing.
    if (
        prefix is None
        or math.isinf(float(prefix[0]))
        or ("e" not in prefix[0].lower() and word[prefix.end()] in "eE")
    ):
        raise UncleanText("unreadable", word)
    raise UncleanText("cut", word, float(prefix[0]))


def parse_integer(word: str) -> int:
    """One whole number; nothing may follow it."""
    if re.fullmatch(r"[+-]?[0-9]+", word) is None:
        raise UncleanText("unreadable", word)
    return int(word)


def parse_flag(word: str) -> bool:
    """A switch: true or false in any case, 1 or 0."""
    lowered = word.lower()
    if lowered in ("true", "1"):
        return True
    if lowered in ("false", "0"):
        return False
    raise UncleanText("unreadable", word)


def parse_legacy_flag(word: str) -> bool:
    """A switch of the first property system, where everything but ``true`` is false, ``1`` too."""
    lowered = word.lower()
    if lowered not in _PLAIN_FLAGS:
        raise UncleanText("ignored", word, False)
    return _PLAIN_FLAGS[lowered]


def _parse_exact_flag(word: str) -> bool:
    """A switch in a list of the first property system, where everything but ``true`` in these letters is false."""
    if word not in _PLAIN_FLAGS:
        raise UncleanText("ignored", word, False)
    return _PLAIN_FLAGS[word]


def _parse_complete_real(word: str) -> float:
    """A number in a list of the first property system: where anything is left over, OpenSim refuses the file."""
    try:
        return parse_real(word)
    except UncleanText:
        raise UncleanText("unreadable", word) from None


def parse_text(raw: str) -> str:
    """A text: white space trimmed, inner runs of it collapsed to one space."""
    return " ".join(split_words(raw))


def split_words(raw: str) -> list[str]:
    """The words of a text. What separates them is ASCII white space: a no-break space is a letter for OpenSim."""
    return raw.split() if raw.isascii() else _OTHER.findall(raw)


_OTHER = re.compile(r"[^ \t\n\r\f\v]+")
_WORDS: dict[str, Callable[[str], Any]] = {
    "double": parse_real,
    "int": parse_integer,
    "bool": parse_flag,
    "string": str,
}


@cache
def make_converter(kind: Kind) -> Callable[[str], Any]:
    """The function that reads the text of a property of this kind; it raises Unclean where OpenSim would not object."""
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
        # OpenSim keeps the default of a vector whose element is empty.
        return _make_list_converter(word, 1, None)
    if kind.legacy and kind.scalar != "string":
        return _make_legacy_converter(
            {"bool": _parse_exact_flag, "double": _parse_complete_real, "int": parse_integer}[
                kind.scalar
            ]
        )
    return _make_list_converter(word, kind.least, kind.most)


def reads_as(raw: str, kind: Kind, value: Any) -> bool:
    """Return whether the text of a property of this kind is plainly a value."""
    try:
        return bool(make_converter(kind)(raw) == value)
    except UncleanText:
        return False


def _make_single_converter(
    read: Callable[[str], Any], optional: bool, legacy: bool
) -> Callable[[str], Any]:
    def convert(raw: str) -> Any:
        # Almost every text is one clean number or switch; what follows this is for the rest.
        if read is parse_real:
            try:
                value = float(raw)
                if isfinite(value) and "_" not in raw and raw.isascii():
                    return value
            except ValueError:
                pass
        elif raw in _PLAIN_FLAGS and read is not parse_integer:
            return _PLAIN_FLAGS[raw]
        words = split_words(raw)
        if not words:
            if optional:
                return None
            if read is parse_legacy_flag:
                # OpenSim's first property system takes nothing for no.
                raise UncleanText("empty", "", False)
            raise UncleanText("empty", "")
        if len(words) == 1:
            return read(words[0])
        if not legacy:
            # OpenSim reads them all before it takes the first, and takes none if it cannot read
            # one.
            _parse_words(words[1:], read)
        raise UncleanText("too-many", raw.strip(), read(words[0]))

    return convert


def _parse_words(
    words: list[str], read: Callable[[str], Any]
) -> tuple[list[Any], UncleanText | None]:
    """What OpenSim reads of words, and the first that it cuts; Unclean if it can make nothing of one."""
    values, first = [], None
    for word in words:
        try:
            values.append(read(word))
        except UncleanText as unclean:
            if unclean.value is ABSENT:
                raise
            values.append(unclean.value)
            first = first or unclean
    return values, first


def _make_vector_converter(size: int) -> Callable[[str], Any]:
    def convert(raw: str) -> Any:
        words = split_words(raw)
        try:
            values = tuple(map(float, words))
            if len(values) == size and isfinite(sum(values)) and "_" not in raw and raw.isascii():
                return values
        except ValueError:
            pass
        if not words:
            raise UncleanText("empty", "")
        if len(words) < size:
            raise UncleanText("too-few", raw.strip())
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
    read: Callable[[str], Any], least: int, most: int | None
) -> Callable[[str], Any]:
    def convert(raw: str) -> Any:
        words = split_words(raw)
        if (
            read in (parse_real, _parse_complete_real)
            and least <= len(words)
            and (most is None or len(words) <= most)
        ):
            try:
                numbers = tuple(map(float, words))
                if isfinite(sum(numbers)) and "_" not in raw and raw.isascii():
                    return numbers
            except ValueError:
                pass
        values, first = (words, None) if read is str else _parse_words(words, read)
        if len(values) < least:
            raise UncleanText("too-few" if values else "empty", raw.strip())
        if first is not None:
            raise UncleanText(first.trouble, first.word, tuple(values[:most]))
        if most is not None and len(values) > most:
            raise UncleanText("too-many", raw.strip(), tuple(values[:most]))
        return tuple(values)

    return convert


def _make_legacy_converter(read: Callable[[str], Any]) -> Callable[[str], Any]:
    """Lists of the first property system: blanks or commas between all words, one pair of brackets may surround."""
    plain = _make_list_converter(read, 0, None)

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
    """Seventeen significant digits, as OpenSim prints every number outside lists of the first property system."""
    if value == value and value not in (math.inf, -math.inf):
        return f"{value:.17g}"
    return format_shortest(value)


def format_6_digits(value: float) -> str:
    """OpenSim's six digits where they read back equal, all digits where they would not."""
    words = f"{value:g}"
    return words if float(words) == value else format_17_digits(value)


def make_formatter(kind: Kind, numbers: str) -> Callable[[Any], str]:
    """The function that prints a value of this kind; `numbers` is ``"shortest"`` or ``"opensim"``."""
    return _build_formatter(kind, numbers == "opensim")


@cache
def _build_formatter(kind: Kind, like_opensim: bool) -> Callable[[Any], str]:
    if isinstance(kind, Reference):
        if kind.shape == "list":
            lead = " " if kind.legacy else ""
            return lambda words: lead + " ".join(words) if words else ""
        return str
    assert isinstance(kind, Value)
    if kind.scalar == "double":
        word: Callable[[Any], str] = format_17_digits if like_opensim else format_shortest
        if like_opensim and kind.legacy and kind.shape == "list":
            word = format_6_digits
    elif kind.scalar == "bool":
        word = _format_flag
    else:
        word = str
    if kind.shape in ("single", "optional"):
        return lambda value: "" if value is None else word(value)
    if kind.legacy and kind.scalar == "bool":
        return lambda values: "".join(f"{word(value)} " for value in values)
    lead = " " if kind.legacy else ""
    return lambda values: lead + " ".join(map(word, values)) if values else ""


def _format_flag(value: bool) -> str:
    return "true" if value else "false"
