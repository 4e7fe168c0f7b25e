"""Regular expressions of Moco studies, matched in linear time.

Moco matches the names of states and controls as wholes by `std::regex` (ECMAScript). An engine that
backtracks, as Python's `re` and `std::regex` do, takes exponential time for patterns such as
`(.*)*(.*)*!`, and a study may come from a stranger. This one follows all alternatives at once (K.
Thompson, "Regular expression search algorithm", CACM 11(6), 1968): the time is at most the product
of the lengths of the name and of the pattern. Look-ahead assertions keep to that: one pass from the
end of the name finds all places where an assertion holds. It has ECMAScript's syntax but for back
references, which need memory.
"""

from __future__ import annotations

import string
from collections.abc import Callable, Iterable

from osimlite.base.records import dataclass, field

MAX_STATES = 2000
"""Largest number of states of a pattern; `x{100}` has the states of `x` a hundred times."""

MAX_NESTING = 50
"""Largest depth of nested groups."""

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
    """Error for a text that is no regular expression, or one that is not supported."""


class UnsupportedPatternError(PatternError):
    """Error for a regular expression that `std::regex` may accept but this engine does not."""


@dataclass
class _State:
    """One state of the automaton: it reads a character, or leads on without one."""

    test: CharacterTest | None = None
    anchor: str = ""  # "^", "$", "b", "B", "=" or "!": it leads on only where that holds
    inside: tuple[int, int] = (
        0,
        0,
    )  # of a look-ahead assertion, the first and the last state of its pattern
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
        # Cache of the transitions between sets of states, useful as many names of a model begin
        # alike.
        self._steps: dict[tuple[frozenset[int], str, bool], frozenset[int]] = {}
        self._has_inner_anchors = any(state.anchor not in ("", "^", "$") for state in self._states)
        self._sources: list[list[int]] = [[] for _ in self._states]
        for number, state in enumerate(self._states):
            for following in state.following:
                self._sources[following].append(number)

    def fullmatch(self, name: str) -> bool:
        """Return whether the whole of a name matches."""
        cached_starts: dict[int, list[set[int]]] = {}
        reached = self._find_reachable_states([self._first], name, 0, cached_starts)
        for index, character in enumerate(name):
            key = reached, character, index == len(name) - 1
            following = None if self._has_inner_anchors else self._steps.get(key)
            if following is None:
                states = [self._states[number] for number in reached]
                next_states = [
                    state.following[0]
                    for state in states
                    if state.test is not None and state.test(character)
                ]
                following = self._find_reachable_states(next_states, name, index + 1, cached_starts)
                if not self._has_inner_anchors:
                    self._steps[key] = following
            reached = following
        return self._final in reached

    def _find_reachable_states(
        self,
        numbers: Iterable[int],
        name: str,
        index: int,
        cached_starts: dict[int, list[set[int]]],
    ) -> frozenset[int]:
        """Return some states and all that they lead to without a character, before a character of a name."""
        waiting = [*numbers]
        reached = set[int]()
        while waiting:
            number = waiting.pop()
            if number in reached:
                continue
            reached.add(number)
            if self._states[number].test is None and self._can_pass(
                number, name, index, cached_starts
            ):
                waiting += self._states[number].following
        return frozenset(reached)

    def _can_pass(
        self, number: int, name: str, index: int, cached_starts: dict[int, list[set[int]]]
    ) -> bool:
        """Return whether a state that reads no character leads on before a character of a name."""
        state = self._states[number]
        match state.anchor:
            case "":
                return True
            case "^":
                return index == 0
            case "$":
                return index == len(name)
            case "b" | "B":
                is_word_before = name[max(index - 1, 0) : index] in _WORD
                is_word_after = name[index : index + 1] in _WORD
                return (is_word_before != is_word_after) == (state.anchor == "b")
        if number not in cached_starts:
            cached_starts[number] = self._find_matching_starts(state.inside[1], name, cached_starts)
        return (state.inside[0] in cached_starts[number][index]) == (state.anchor == "=")

    def _find_matching_starts(
        self, final: int, name: str, cached_starts: dict[int, list[set[int]]]
    ) -> list[set[int]]:
        """Return, before each character of a name and at its end, the states that lead to a final one.

        Returns:
            A set of states for each position in the name, from 0 to its length.
        """
        result: list[set[int]] = [set() for _ in range(len(name) + 1)]
        for index in range(len(name), -1, -1):
            waiting = [final]
            for reached in result[index + 1] if index < len(name) else ():
                for source in self._sources[reached]:
                    test = self._states[source].test
                    if test is not None and test(name[index]):
                        waiting.append(source)
            while waiting:
                number = waiting.pop()
                if number in result[index]:
                    continue
                result[index].add(number)
                waiting += (
                    source
                    for source in self._sources[number]
                    if self._states[source].test is None
                    and self._can_pass(source, name, index, cached_starts)
                )
        return result


class _Compiler:
    """A parser that makes states of a pattern as it reads it; a part is its first and its last state."""

    def __init__(self, text: str) -> None:
        self.text, self.index, self.level = text, 0, 0
        self.states: list[_State] = []
        self.first, self.final = self._compile_alternatives()
        if self.index < len(text):
            raise PatternError(f"a ')' without its '(' at character {self.index + 1}")

    def _add_state(self, test: CharacterTest | None = None, anchor: str = "") -> int:
        if len(self.states) >= MAX_STATES:
            raise UnsupportedPatternError(
                f"the pattern has more than {MAX_STATES} states; shorten its repetitions"
            )
        self.states.append(_State(test, anchor))
        return len(self.states) - 1

    def _link_states(self, source: int, *targets: int) -> None:
        self.states[source].following.extend(targets)

    def _peek_character(self) -> str:
        return self.text[self.index : self.index + 1]

    def _take_character(self) -> str:
        character = self._peek_character()
        if not character:
            raise PatternError("the pattern ends too early")
        self.index += 1
        return character

    def _skip_text(self, word: str) -> bool:
        is_there = self.text.startswith(word, self.index)
        self.index += len(word) if is_there else 0
        return is_there

    def _compile_alternatives(self) -> tuple[int, int]:
        first, last = self._add_state(), self._add_state()
        while True:
            start, end = self._compile_sequence()
            self._link_states(first, start)
            self._link_states(end, last)
            if not self._skip_text("|"):
                return first, last

    def _compile_sequence(self) -> tuple[int, int]:
        first = last = self._add_state()
        while self._peek_character() not in ("", "|", ")"):
            begin = self.index
            start, end = self._compile_atom()
            while self._peek_character() in ("*", "+", "?", "{") and self._peek_character():
                start, end = self._repeat_part(begin, start, end)
            self._link_states(last, start)
            last = end
        return first, last

    def _repeat_part(self, begin: int, start: int, end: int) -> tuple[int, int]:
        """Repeat a part as often as the quantifier after it says.

        Args:
            begin: index of the part in the text, from which it is compiled again for each
                repetition.
            start: first state of the part.
            end: last state of the part.

        Returns:
            The first and the last state of all repetitions.
        """
        part_end = self.index
        min_count, max_count = self._read_quantifier()
        self._skip_text("?")  # The shortest or the longest match: of whole names both are the same.
        next_index = self.index
        entry = tail = self._add_state()
        copies = min_count if max_count is None else max_count
        pieces = [(start, end)]
        for _ in range(max(copies, 1) - 1):
            # Each repetition needs states of its own: with shared ones, a name could go back to an
            # earlier repetition, and the counts would have no effect.
            pieces.append(self._recompile_part(begin, part_end))
        self.index = next_index
        skips: list[int] = []
        for number, (piece_start, piece_end) in enumerate(pieces):
            if number >= min_count:
                skips.append(tail)
            if copies:
                self._link_states(tail, piece_start)
                tail = piece_end
        finish = self._add_state()
        if max_count is None:
            # The last piece may come again and again; without a least number it may also be left
            # out.
            self._link_states(tail, finish, pieces[-1][0])
        else:
            self._link_states(tail, finish)
        if max_count is None and min_count == 0:
            self._link_states(entry, pieces[0][0], finish)
            self._link_states(pieces[0][1], pieces[0][0], finish)
        for skip in skips if max_count is not None else ():
            self._link_states(skip, finish)
        return entry, finish

    def _recompile_part(self, begin: int, end: int) -> tuple[int, int]:
        self.index = begin
        start, last = self._compile_atom()
        while self.index < end:
            start, last = self._repeat_part(begin, start, last)
        return start, last

    def _read_quantifier(self) -> tuple[int, int | None]:
        """Read a quantifier such as ``*`` or ``{2,3}``.

        Returns:
            Smallest and largest count; or None as the largest without a bound.

        Raises:
            PatternError: the quantifier is incomplete, or its counts are reversed.
        """
        sign = self._take_character()
        if sign != "{":
            return {"*": (0, None), "+": (1, None), "?": (0, 1)}[sign]
        min_count = self._read_number()
        if self._skip_text("}"):
            return min_count, min_count
        if not self._skip_text(","):
            raise PatternError(f"a ',' or a '}}' is missing at character {self.index + 1}")
        max_count = None if self._peek_character() == "}" else self._read_number()
        if not self._skip_text("}"):
            raise PatternError(f"a '}}' is missing at character {self.index + 1}")
        if max_count is not None and max_count < min_count:
            raise PatternError(f"a repetition of {min_count} to {max_count} times is impossible")
        return min_count, max_count

    def _read_number(self) -> int:
        digits = ""
        while self._peek_character() in _DIGITS:
            digits += self._take_character()
        # More digits mean more repetitions than `MAX_STATES`.
        if not digits or len(digits) > 4:
            raise PatternError(
                f"a number of repetitions is missing or too large at character {self.index + 1}"
            )
        return int(digits)

    def _compile_atom(self) -> tuple[int, int]:
        """Compile a character, a set, a group or an anchor.

        Returns:
            First and last state of the part.

        Raises:
            PatternError: a quantifier has nothing to repeat.
        """
        character = self._take_character()
        if character == "(":
            return self._compile_group()
        if character in "*+?{":
            raise PatternError(f"'{character}' has nothing to repeat at character {self.index}")
        if character in "^$":
            state = self._add_state(anchor=character)
        elif character == "[":
            state = self._add_state(self._compile_bracket())
        elif character == ".":
            # The line terminators of ECMAScript, which `.` does not match.
            state = self._add_state(lambda letter: letter not in "\n\r\u2028\u2029")
        elif character == "\\" and self._peek_character() in ("b", "B"):
            return self._compile_assertion(self._take_character())
        elif character == "\\":
            state = self._add_state(self._compile_escape())
        else:
            state = self._add_state(frozenset(character).__contains__)
        end_state = self._add_state()
        self._link_states(state, end_state)
        return state, end_state

    def _compile_group(self) -> tuple[int, int]:
        """Compile a group or a look-ahead assertion.

        Returns:
            First and last state of the part.

        Raises:
            PatternError: the group is not closed, or its kind is unknown.
            UnsupportedPatternError: groups nest too deeply.
        """
        assertion = ""
        if self._skip_text("?") and not self._skip_text(":"):
            assertion = self._take_character()
            if assertion not in "=!":
                raise PatternError(
                    f"'(?{assertion}' begins no group; OpenSim knows '(?:', '(?=' and '(?!'"
                )
        self.level += 1
        if self.level > MAX_NESTING:
            raise UnsupportedPatternError(f"groups nest more than {MAX_NESTING} levels deep")
        part = self._compile_alternatives()
        self.level -= 1
        if not self._skip_text(")"):
            raise PatternError("a ')' is missing")
        return self._compile_assertion(anchor=assertion, inner_part=part) if assertion else part

    def _compile_assertion(
        self, anchor: str, inner_part: tuple[int, int] = (0, 0)
    ) -> tuple[int, int]:
        """Return a part that reads nothing, and that leads on only where an assertion holds."""
        state = self._add_state(anchor=anchor)
        end_state = self._add_state()
        self.states[state].inside = inner_part
        self._link_states(state, end_state)
        return state, end_state

    def _compile_escape(self) -> CharacterTest:
        characters, is_negated = self._read_escaped_set()
        return _make_set_test(characters, is_negated)

    def _read_escaped_set(self) -> tuple[frozenset[str], bool]:
        """Return the characters that an escape stands for, and whether it stands for all others.

        Raises:
            PatternError: the digits of a code are no hexadecimal number.
            UnsupportedPatternError: this matcher does not know the escape.
        """
        letter = self._take_character()
        if letter.lower() in _ESCAPED_CLASSES:
            return _ESCAPED_CLASSES[letter.lower()], letter.isupper()
        if letter in _ESCAPED_CHARACTERS:
            return frozenset(_ESCAPED_CHARACTERS[letter]), False
        if letter in "xu":
            digits = "".join(self._take_character() for _ in range(2 if letter == "x" else 4))
            if not frozenset(string.hexdigits).issuperset(digits):
                raise PatternError(f"'\\{letter}{digits}' is not a character")
            return frozenset(chr(int(digits, 16))), False
        # Digits are back references, which this algorithm cannot match.
        if letter.isalnum():
            raise UnsupportedPatternError(f"'\\{letter}' is not supported")
        return frozenset(letter), False

    def _compile_bracket(self) -> CharacterTest:
        """Compile a set in brackets.

        Returns:
            A test of one character.

        Raises:
            PatternError: a range in the set is not valid.
        """
        is_negated = self._skip_text("^")
        tests: list[CharacterTest] = []
        # As in ECMAScript, `[]` is an empty set that matches nothing, not a set that begins with
        # `]`.
        while not self._skip_text("]"):
            low = self._read_bracket_item(tests)
            if (
                low is None
                or self._peek_character() != "-"
                # A hyphen before the closing bracket stands for itself.
                or self.text[self.index + 1 : self.index + 2] in ("]", "")
            ):
                if low is not None:
                    tests.append(frozenset(low).__contains__)
                continue
            self.index += 1
            high = self._read_bracket_item(tests)
            if high is None or high < low:
                raise PatternError(f"the range from '{low}' has no end, or an end before its start")
            tests.append(_make_range_test(low, high))
        return lambda letter: any(test(letter) for test in tests) != is_negated

    def _read_bracket_item(self, tests: list[CharacterTest]) -> str | None:
        """Return the next character of a bracket; of a class, None, and its test is added.

        Raises:
            PatternError: a class such as ``[:name:]`` does not exist.
        """
        if self._skip_text("[:"):
            end = self.text.find(":]", self.index)
            name = self.text[self.index : max(end, self.index)]
            if name not in _NAMED_CLASSES:
                raise PatternError(f"unknown character class '{name}'")
            self.index = end + 2
            tests.append(_NAMED_CLASSES[name].__contains__)
            return None
        character = self._take_character()
        if character != "\\":
            return character
        # Within brackets `\b` is a backspace, outside of them a word boundary.
        if self._skip_text("b"):
            return "\b"
        characters, is_negated = self._read_escaped_set()
        if len(characters) == 1 and not is_negated:
            return next(iter(characters))
        tests.append(_make_set_test(characters, is_negated))
        return None


def _make_set_test(characters: frozenset[str], is_negated: bool) -> CharacterTest:
    return (lambda letter: letter not in characters) if is_negated else characters.__contains__


def _make_range_test(low: str, high: str) -> CharacterTest:
    """Return a test for characters from `low` to `high`, both included."""
    return lambda letter: low <= letter <= high
