"""Tests of escaping: control characters that a terminal or the log of a CI job obeys are written out."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rapidfuzz import fuzz

from osimlite.base.text import (
    MAX_COMPARED_NAMES,
    add_article,
    append_clause,
    escape_control_sequences,
    escape_unprintable,
    find_nearest,
    format_json,
    format_time_span,
    measure_similarity,
    suggest_path,
)
from osimlite.errors import OsimliteError

OBEYED = re.compile(
    r"[\0-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)
anything = st.text(
    st.one_of(
        st.characters(codec=None), st.sampled_from("\n\r\t\x1b\x9b\x85\u202e\u2028\udce9[]m#:0 ")
    )
)


@pytest.mark.parametrize(
    ("text", "seen"),
    [
        ("knee_angle_r", "knee_angle_r"),
        ("Größe 3 → λ", "Größe 3 → λ"),
        ("a\n::error::b", r"a\n::error::b"),
        ("\x1b]0;title\x07", r"\x1b]0;title\x07"),
        ("\x9b2J\x85", r"\x9b2J\x85"),
        ("\u202eevil\u2066\u200b\ufeff", r"\u202eevil\u2066\u200b\ufeff"),
        ("caf\udce9", r"caf\xe9"),
        ("\ud800\0", r"\ud800\x00"),
    ],
)
def test_visible(text: str, seen: str) -> None:
    assert escape_unprintable(text) == seen


@given(anything)
def test_what_is_visible_is_one_line_and_stays_so(text: str) -> None:
    seen = escape_unprintable(text)
    assert seen.isprintable() and escape_unprintable(seen) == seen
    assert text.isprintable() == (seen == text)


@pytest.mark.parametrize(
    ("text", "seen"),
    [
        ("\x1b[1;31mred\x1b[0m\n\ttab\r\n", "\x1b[1;31mred\x1b[0m\n\ttab\r\n"),
        ("\x1b[2J\x1b]8;;x\x07\r", r"\x1b[2J\x1b]8;;x\x07\r"),
        ("OpenSim::Body\n  ::error::x", "OpenSim::Body\n  \\x3a:error::x"),
        ("\u3000::stop-commands::x", "\u3000\\x3a:stop-commands::x"),
        ("a ##[add-mask]b ##vso[task.x] ## [1]", r"a \x23#[add-mask]b \x23#vso[task.x] ## [1]"),
        ("##teamcity[y]", r"\x23#teamcity[y]"),
    ],
)
def test_harmless(text: str, seen: str) -> None:
    assert escape_control_sequences(text) == seen


def test_a_line_that_goes_on_holds_no_command_at_its_start() -> None:
    assert escape_control_sequences("::error::x", starts_line=False) == "::error::x"


@given(anything)
def test_nothing_is_obeyed(text: str) -> None:
    seen = escape_control_sequences(text)
    left = re.sub(r"\x1b\[[0-9;]*m|\r\n", "", seen)
    assert not OBEYED.search(left) and not re.search(r"##\w*\[", seen)
    assert not any(line.lstrip().startswith("::") for line in seen.split("\n"))


@given(anything)
def test_json_for_programs_keeps_everything_and_passes_everywhere(text: str) -> None:
    written = format_json({text: [text]})
    # JSON for exchange contains no lone surrogates (RFC 8259, 8.2); `format_json` escapes them
    # visibly.
    whole = text.encode("utf-16-le", "surrogatepass").decode("utf-16-le", "surrogatepass")
    whole = "".join(escape_unprintable(c) if "\ud800" <= c <= "\udfff" else c for c in whole)
    assert written.isascii() and json.loads(written) == {whole: [whole]}
    assert next(iter(json.loads(written))).encode().decode() == whole
    assert not OBEYED.search(written) and "##" not in written


def test_errors_and_findings_are_one_line() -> None:
    from osimlite.lint.diagnostic import Finding, Severity

    error = OsimliteError("no body 'a\n::error::b'", file="\x1b[2J.osim", line=3)
    assert str(error) == r"\x1b[2J.osim:3: no body 'a\n::error::b'" and "\n" in error.message
    finding = Finding(
        "OSIM101", "unknown-tag", Severity.ERROR, "a\nb", "\x9b.osim", suggestion="\u202e"
    )
    assert str(finding) == r"\x9b.osim: error OSIM101 a\nb (did you mean '\u202e'?)"


names = st.text(st.sampled_from("abc_rlé"), max_size=12)


@given(names, names)
def test_similarity_is_that_of_rapidfuzz(word: str, text: str) -> None:
    assert measure_similarity(word)(text) == fuzz.ratio(word, text)


@given(names, st.lists(names, max_size=8))
def test_few_names_are_compared_as_many_are(word: str, known: list[str]) -> None:
    many = [*known, *("%" for _ in range(MAX_COMPARED_NAMES + 1))]
    assert find_nearest(word, known) == find_nearest(word, many)


def test_the_nearest_name() -> None:
    assert find_nearest("Tibia_R", ["femur_r", "tibia_l", "tibia_r"]) == "tibia_r"
    assert find_nearest("tibia", ["femur_r", "tibia_l", "tibia_r"]) == "tibia_l"
    assert find_nearest("xyz", ["femur_r", "tibia_l"]) is None
    assert find_nearest("xyz", []) is None


@pytest.mark.parametrize(
    ("word", "names", "nearest"),
    [
        # The letter l of "angle" makes both legs equally similar.
        ("mtp_l", ["mtp_angle_r", "mtp_angle_l"], "mtp_angle_l"),
        ("vas_l", ["vas_lat_r", "vas_lat_l"], "vas_lat_l"),
        ("add_r", ["add_brev_l", "add_mag33_r", "add_brev_r"], "add_brev_r"),
        ("glmin2r_-P1", ["glmin2_l-P1", "glmin2_r-P1"], "glmin2_r-P1"),
        ("ulna_r_geom", ["/bodyset/ulna_l/ulna_r_geom", "/b/ulna_r_geom"], "/b/ulna_r_geom"),
        ("RHip_z", ["LHip_rz", "RHip_flexz"], "RHip_flexz"),
        ("RASIS", ["LASI", "RASI_ant"], "RASI_ant"),
        ("Left Toe", ["Right Toes", "Left Big Toe"], "Left Big Toe"),
        ("hipR", ["hipsL", "hip_abdR"], "hip_abdR"),
        ("kneeRight", ["kneesLeft", "kneesRight"], "kneesRight"),
        # Names without a side are on none of the two.
        ("lumbar_r", ["lumbar_bend_l", "lumbar", "lumbar_bend_r"], "lumbar"),
        # Only the side is wrong, or the model has only the other side.
        ("knee_angle_r", ["ankle_angle_r", "knee_angle_l"], "knee_angle_l"),
        ("knee_angel_r", ["hip_flexion_r", "knee_angle_l"], "knee_angle_l"),
    ],
)
def test_the_nearest_name_is_on_the_same_side(word: str, names: list[str], nearest: str) -> None:
    assert find_nearest(word, names) == nearest
    assert find_nearest(word, names[::-1]) == nearest


def test_the_nearest_path_is_on_the_same_side() -> None:
    states = ["/jointset/mtp_r/mtp_angle_r/value", "/jointset/mtp_l/mtp_angle_l/value"]
    assert states[1] in suggest_path("/jointset/mtp_l/angle/value", states)


@pytest.mark.parametrize(
    ("noun", "words"),
    [
        ("Body", "a Body"),
        ("<InverseDynamicsTool>", "an <InverseDynamicsTool>"),
        ("RRATool", "an RRATool"),
        ("UniversalJoint", "a UniversalJoint"),
        ("Umberger2010MuscleMetabolicsProbe", "an Umberger2010MuscleMetabolicsProbe"),
    ],
)
def test_articles(noun: str, words: str) -> None:
    assert add_article(noun) == words


def test_spans_of_times() -> None:
    assert format_time_span(0.5, 2.0) == "between 0.5 and 2 s"
    assert format_time_span(5.0, float("inf")) == "after 5 s"
    assert format_time_span(float("-inf"), 0.1) == "before 0.1 s"


@pytest.mark.parametrize(
    ("message", "separator", "sentence"),
    [
        ("no body 'femr'", ";", "no body 'femr'; choose another"),
        ("no body 'femr'", ":", "no body 'femr': choose another"),
        ("no body; did you mean 'femur'?", ";", "no body; did you mean 'femur'? Choose another"),
        ("no body; did you mean 'femur'?", ":", "no body; did you mean 'femur'? Choose another"),
        ("port must be 0-65535.", ";", "port must be 0-65535; choose another"),
        ("expected 1 2 ...", ";", "expected 1 2 ...; choose another"),
    ],
)
def test_a_clause_after_a_suggestion_is_a_sentence(
    message: str, separator: str, sentence: str
) -> None:
    assert append_clause(message, "choose another", separator=separator) == sentence


SUGGESTING = {"suggest_name", "suggest_path", "suggest_or_list", "suggest_names", "add_suggestion"}


def find_text_after_suggestions(tree: ast.Module) -> Iterator[int]:
    """Yield the line of each f-string that continues after a message with a suggestion, or an error."""
    for scope in ast.walk(tree):
        if not isinstance(scope, ast.FunctionDef):
            continue
        nodes = list(ast.walk(scope))
        # Names whose text may end with a question mark or a full stop.
        names = {node.name for node in nodes if isinstance(node, ast.ExceptHandler)} | {
            target.id
            for node in nodes
            if isinstance(node, ast.Assign)
            for target in node.targets
            if isinstance(target, ast.Name)
            if "did you mean" in ast.unparse(node.value) or calls_suggestion(node.value)
        }
        for node in nodes:
            if not isinstance(node, ast.JoinedStr):
                continue
            for part, after in zip(node.values, node.values[1:], strict=False):
                if not isinstance(part, ast.FormattedValue) or not isinstance(after, ast.Constant):
                    continue
                value, text = part.value, str(after.value)
                if (
                    not text.startswith(" (")
                    if calls_suggestion(value)
                    else text[0] in ";:.,"
                    and (
                        (isinstance(value, ast.Name) and value.id in names)
                        or (isinstance(value, ast.Attribute) and value.attr == "message")
                    )
                ):
                    yield node.lineno


ASSIGNED = re.compile(r"^ *except .* as (\w+):$|^ *(\w+) = .*(?:suggest_|did you mean|\($)", re.M)
CONTINUED = re.compile(r"suggest_\w+\([^{}]*\)\}[^\"]|\.message\}[;:.,]|\{(\w+)\}[;:.,]")


def may_continue(text: str) -> bool:
    """Return whether a module is worth parsing, which takes long."""
    continued = {match[1] for match in CONTINUED.finditer(text)}
    return None in continued or any(
        name in continued for pair in ASSIGNED.findall(text) for name in pair if continued
    )


def calls_suggestion(node: ast.AST) -> bool:
    """Return whether an expression calls a function that returns a suggestion."""
    return any(
        isinstance(part, ast.Call)
        and isinstance(part.func, ast.Name)
        and part.func.id in SUGGESTING
        for part in ast.walk(node)
    )


def test_no_message_continues_after_a_suggestion(repo: Path) -> None:
    """``append_clause`` avoids "?;", "?:" and ".;"."""
    wrong = [
        f"{path.relative_to(repo)}:{line}"
        for path in sorted((repo / "osimlite").rglob("*.py"))
        if may_continue(text := path.read_text(encoding="utf-8"))
        for line in find_text_after_suggestions(ast.parse(text))
    ]
    assert wrong == []
