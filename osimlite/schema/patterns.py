"""Regular expressions of Moco studies, matched in linear time.

Moco matches the names of states and controls as wholes by `std::regex` (ECMAScript). An engine that
backtracks, as Python's `re` and `std::regex` do, takes exponential time for patterns such as
`(.*)*(.*)*!`, and a study may come from a stranger. This one follows all alternatives at once
(K. Thompson, "Regular expression search algorithm", CACM 11(6), 1968): the time is at most the product
of the lengths of the name and of the pattern. It has ECMAScript's syntax but for what needs memory or
looks around: back references, `(?=`, `(?!` and `\\b`.
"""

from __future__ import annotations

import string
from collections.abc import Callable, Iterable

from osimlite.records import dataclass, field

MAX_STATES = 2000
"""States of one pattern. A repetition such as `x{100}` has the states of `x` a hundred times."""

MAX_NESTING = 50
"""Groups within groups."""

CharacterTest = Callable[[str], bool]

_DIGITS = frozenset(string.digits)
_WORD = frozenset(string.ascii_letters + string.digits + "_")
_SPACE = frozenset(" \t\n\r\f\v\u00a0\ufeff\u2028\u2029")
_ESCAPED_CLASSES = {"d": _DIGITS, "w": _WORD, "s": _SPACE}
_ESCAPED_CHARACTERS = {"t": "\t", "n": "\n", "r": "\r", "f": "\f", "v": "\v", "0": "\0"}
_NAMED_CLASSES = {
    "alnum": frozenset(string.ascii_letters + string.digits),
    "alpha": frozenset(string.ascii_letters),
    "digit": _DIGITS,
    "lower": frozenset(string.ascii_lowercase),
    "punct": frozenset(string.punctuation),
    "space": _SPACE,
    "upper": frozenset(string.ascii_uppercase),
    "xdigit": frozenset(string.hexdigits),
}


class PatternError(ValueError):
    """A text is no regular expression, or one that is not supported."""


class UnsupportedPatternError(PatternError):
    """A regular expression that `std::regex` may take and this engine does not."""


@dataclass
class _State:
    """One state of the automaton: it reads a character, or leads on without one."""

    test: CharacterTest | None = None
    anchor: str = ""  # "^" or "$": whether it leads on at the start or the end of the name alone
    following: list[int] = field(default_factory=list)


class Pattern:
    """A regular expression that whole names are matched with."""

    def __init__(self, text: str) -> None:
        """Compile a regular expression.

        Raises:
            PatternError: it is none, it is too large, or it has a part that is not supported.
        """
        compiler = _Compiler(text)
        self._states, self._first, self._final = compiler.states, compiler.first, compiler.final
        # What each character leads to from sets of states: the names of a model begin alike.
        self._steps: dict[tuple[frozenset[int], str, bool], frozenset[int]] = {}

    def fullmatch(self, name: str) -> bool:
        """Return whether the whole of a name matches."""
        reached = self._lead_on([self._first], at_start=True, at_end=not name)
        for index, character in enumerate(name):
            key = reached, character, index == len(name) - 1
            if key not in self._steps:
                states = [self._states[number] for number in reached]
                read = [state.following[0] for state in states if state.test is not None and state.test(character)]
                self._steps[key] = self._lead_on(read, at_start=False, at_end=key[2])
            reached = self._steps[key]
        return self._final in reached

    def _lead_on(self, numbers: Iterable[int], *, at_start: bool, at_end: bool) -> frozenset[int]:
        """Return some states and all that they lead to without a character."""
        waiting, reached = [*numbers], set[int]()
        while waiting:
            number = waiting.pop()
            if number in reached:
                continue
            reached.add(number)
            state = self._states[number]
            if state.test is None and {"": True, "^": at_start, "$": at_end}[state.anchor]:
                waiting += state.following
        return frozenset(reached)


class _Compiler:
    """A parser that makes states of a pattern as it reads it; a part is its first and its last state."""

    def __init__(self, text: str) -> None:
        self.text, self.index, self.level = text, 0, 0
        self.states: list[_State] = []
        self.first, self.final = self._alternatives()
        if self.index < len(text):
            raise PatternError(f"a ')' without its '(' at character {self.index + 1}")

    def _add(self, test: CharacterTest | None = None, anchor: str = "") -> int:
        if len(self.states) >= MAX_STATES:
            raise UnsupportedPatternError(f"the pattern has more than {MAX_STATES} states; shorten its repetitions")
        self.states.append(_State(test, anchor))
        return len(self.states) - 1

    def _link(self, source: int, *targets: int) -> None:
        self.states[source].following.extend(targets)

    def _peek(self) -> str:
        return self.text[self.index : self.index + 1]

    def _take(self) -> str:
        character = self._peek()
        if not character:
            raise PatternError("the pattern ends in the middle of something")
        self.index += 1
        return character

    def _takes(self, word: str) -> bool:
        is_there = self.text.startswith(word, self.index)
        self.index += len(word) if is_there else 0
        return is_there

    def _alternatives(self) -> tuple[int, int]:
        first, last = self._add(), self._add()
        while True:
            start, end = self._sequence()
            self._link(first, start)
            self._link(end, last)
            if not self._takes("|"):
                return first, last

    def _sequence(self) -> tuple[int, int]:
        first = last = self._add()
        while self._peek() not in ("", "|", ")"):
            begin = self.index
            start, end = self._atom()
            while self._peek() in ("*", "+", "?", "{") and self._peek():
                start, end = self._repeat_part(begin, start, end)
            self._link(last, start)
            last = end
        return first, last

    def _repeat_part(self, begin: int, start: int, end: int) -> tuple[int, int]:
        """Return a part as often as the quantifier that comes next says.

        Args:
            begin: index of the part in the text, from which it is compiled again for each repetition.
            start: its first state.
            end: its last state.
        """
        part_end = self.index
        least, most = self._quantifier()
        self._takes("?")  # The shortest or the longest match: of whole names both are the same.
        after = self.index
        first = last = self._add()
        copies = least if most is None else most
        pieces = [(start, end)]
        for _ in range(max(copies, 1) - 1):
            pieces.append(self._recompile(begin, part_end))
        self.index = after
        skips: list[int] = []
        for number, (piece_start, piece_end) in enumerate(pieces):
            if number >= least:
                skips.append(last)
            if copies:
                self._link(last, piece_start)
                last = piece_end
        finish = self._add()
        if most is None:
            # The last piece may come again and again; without a least number it may also be left out.
            self._link(last, finish, pieces[-1][0])
        else:
            self._link(last, finish)
        if most is None and least == 0:
            self._link(first, pieces[0][0], finish)
            self._link(pieces[0][1], pieces[0][0], finish)
        for skip in skips if most is not None else ():
            self._link(skip, finish)
        return first, finish

    def _recompile(self, begin: int, end: int) -> tuple[int, int]:
        self.index = begin
        start, last = self._atom()
        while self.index < end:
            start, last = self._repeat_part(begin, start, last)
        return start, last

    def _quantifier(self) -> tuple[int, int | None]:
        sign = self._take()
        if sign != "{":
            return {"*": (0, None), "+": (1, None), "?": (0, 1)}[sign]
        least = self._number()
        if self._takes("}"):
            return least, least
        if not self._takes(","):
            raise PatternError(f"a ',' or a '}}' is missing at character {self.index + 1}")
        most = None if self._peek() == "}" else self._number()
        if not self._takes("}"):
            raise PatternError(f"a '}}' is missing at character {self.index + 1}")
        if most is not None and most < least:
            raise PatternError(f"a repetition of {least} to {most} times is none")
        return least, most

    def _number(self) -> int:
        digits = ""
        while self._peek() in _DIGITS:
            digits += self._take()
        if not digits or len(digits) > 4:
            raise PatternError(f"a number of repetitions is missing or too large at character {self.index + 1}")
        return int(digits)

    def _atom(self) -> tuple[int, int]:
        character = self._take()
        if character == "(":
            return self._group()
        if character in "*+?{":
            raise PatternError(f"'{character}' has nothing to repeat at character {self.index}")
        if character in "^$":
            state = self._add(anchor=character)
        elif character == "[":
            state = self._add(self._bracket())
        elif character == ".":
            state = self._add(lambda each: each not in "\n\r\u2028\u2029")
        elif character == "\\":
            state = self._add(self._escape())
        else:
            state = self._add(frozenset(character).__contains__)
        after = self._add()
        self._link(state, after)
        return state, after

    def _group(self) -> tuple[int, int]:
        if self._takes("?") and not self._takes(":"):
            raise UnsupportedPatternError("'(?=' and '(?!' are not supported")
        self.level += 1
        if self.level > MAX_NESTING:
            raise UnsupportedPatternError(f"groups nest more than {MAX_NESTING} levels deep")
        part = self._alternatives()
        self.level -= 1
        if not self._takes(")"):
            raise PatternError("a ')' is missing")
        return part

    def _escape(self) -> CharacterTest:
        characters, is_negated = self._read_escaped_set()
        return _test(characters, is_negated)

    def _read_escaped_set(self) -> tuple[frozenset[str], bool]:
        """Return the characters that an escape stands for, and whether it stands for all others."""
        letter = self._take()
        if letter.lower() in _ESCAPED_CLASSES:
            return _ESCAPED_CLASSES[letter.lower()], letter.isupper()
        if letter in _ESCAPED_CHARACTERS:
            return frozenset(_ESCAPED_CHARACTERS[letter]), False
        if letter in "xu":
            digits = "".join(self._take() for _ in range(2 if letter == "x" else 4))
            if not frozenset(string.hexdigits).issuperset(digits):
                raise PatternError(f"'\\{letter}{digits}' is no character")
            return frozenset(chr(int(digits, 16))), False
        if letter.isalnum():
            raise UnsupportedPatternError(f"'\\{letter}' is not supported")
        return frozenset(letter), False

    def _bracket(self) -> CharacterTest:
        is_negated = self._takes("^")
        tests: list[CharacterTest] = []
        while not self._takes("]"):
            low = self._bracket_item(tests)
            if low is None or self._peek() != "-" or self.text[self.index + 1 : self.index + 2] in ("]", ""):
                if low is not None:
                    tests.append(frozenset(low).__contains__)
                continue
            self.index += 1
            high = self._bracket_item(tests)
            if high is None or high < low:
                raise PatternError(f"the range from '{low}' ends nowhere")
            tests.append(_make_range_test(low, high))
        return lambda each: any(test(each) for test in tests) != is_negated

    def _bracket_item(self, tests: list[CharacterTest]) -> str | None:
        """Return the next character of a bracket; of a class, None, and its test is added."""
        if self._takes("[:"):
            end = self.text.find(":]", self.index)
            name = self.text[self.index : max(end, self.index)]
            if name not in _NAMED_CLASSES:
                raise PatternError(f"there is no class of characters '{name}'")
            self.index = end + 2
            tests.append(_NAMED_CLASSES[name].__contains__)
            return None
        character = self._take()
        if character != "\\":
            return character
        if self._takes("b"):
            return "\b"
        characters, is_negated = self._read_escaped_set()
        if len(characters) == 1 and not is_negated:
            return next(iter(characters))
        tests.append(_test(characters, is_negated))
        return None


def _test(characters: frozenset[str], is_negated: bool) -> CharacterTest:
    return (lambda each: each not in characters) if is_negated else characters.__contains__


def _make_range_test(low: str, high: str) -> CharacterTest:
    """Return a test for characters from `low` to `high`, both included."""
    return lambda each: low <= each <= high
