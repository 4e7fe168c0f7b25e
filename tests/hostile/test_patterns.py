"""Check that patterns in studies and files are matched in linear time, whatever they contain."""

from __future__ import annotations

import random
import re
import time
from pathlib import Path

import pytest

from osimlite.errors import OsimliteError
from osimlite.schema.patterns import MAX_STATES, Pattern, PatternError, UnsupportedPatternError
from osimlite.tools import patterns as file_patterns
from osimlite.tools.named_files import find_named_files
from osimlite.tools.patterns import find_files
from tests.suite import choose

# Patterns for which backtracking takes exponential time.
SLOW = [
    "(.*)*(.*)*(.*)*(.*)*(.*)*!",
    "(a+)+$b",
    "(a|a)*b",
    "(a|aa)+b",
    "((a*)*)*b",
    "(.*a){20}b",
    "(x+x+)+y",
]
ASSERTIONS = ["^", "$", r"\b", "(?=a)", "(?!b)", "(?=a*b)", "(?!(?=b).*/)", "(?=.*(?!a)b)"]
# Pieces of random regular expressions.
ATOMS = [
    "a",
    "b",
    "/",
    ".",
    "[ab]",
    "[^a]",
    r"\w",
    r"\d",
    "(a|b)",
    "(?:ab)",
    "(a*)",
    "(a|)",
    "[a-c]",
    r"\.",
    *ASSERTIONS,
]
QUANTIFIERS = ["", "", "*", "+", "?", "{2}", "{1,2}", "{0,}", "{2,}", "{0}", "*?", "{0,1}"]


@pytest.mark.parametrize("text", SLOW)
def test_nested_quantifiers_take_no_time(text: str) -> None:
    begin = time.process_time()
    assert not Pattern(text).fullmatch("a" * 2000)
    assert not Pattern(text).fullmatch("x" * 2000)
    assert time.process_time() - begin < 2.0


def test_random_patterns_match_as_with_another_engine() -> None:
    rng, compared = random.Random(4), 0

    def make(depth: int) -> str:
        parts = []
        for _ in range(rng.randint(1, 3)):
            atom = f"({make(depth - 1)})" if depth and rng.random() < 0.3 else rng.choice(ATOMS)
            parts.append(atom if atom in ASSERTIONS else atom + rng.choice(QUANTIFIERS))
        return "".join(parts) + (f"|{rng.choice(ATOMS)}" if rng.random() < 0.2 else "")

    count = choose(700, 3000)
    for _ in range(count):
        text = make(2)
        try:
            other = re.compile(text)
        except re.error:
            continue
        pattern = Pattern(text)
        for _ in range(4):
            name = "".join(rng.choice("ab/c.1") for _ in range(rng.randint(0, 5)))
            assert pattern.fullmatch(name) == bool(other.fullmatch(name)), (text, name)
            compared += 1
    assert compared > 2.6 * count


def test_assertions_within_assertions_take_no_time() -> None:
    text = "(?=.*" * 40 + "b" + ")" * 40 + ".*"
    begin = time.process_time()
    assert not Pattern(text).fullmatch("a" * 500)
    assert Pattern(text).fullmatch("a" * 500 + "b")
    assert time.process_time() - begin < 5.0


@pytest.mark.parametrize(
    "text", ["(?<=a).*", "(?<!a).*", "(?i)a", "(?P<x>a)", "(?#a)", "(?", ".*(?=", "(?!a"]
)
def test_what_opensim_refuses_is_no_pattern(text: str) -> None:
    with pytest.raises(PatternError) as error:
        Pattern(text)
    assert not isinstance(error.value, UnsupportedPatternError)


@pytest.mark.parametrize(
    ("text", "name", "is_match"),
    [
        (".*knee.*/value", "/jointset/knee_r/knee_angle_r/value", True),
        ("(?!.*speed).*", "/jointset/j/q/value", True),
        ("(?!.*speed).*", "/jointset/j/q/speed", False),
        (".*(?=speed)speed", "/jointset/j/q/speed", True),
        (".*(?!speed)", "/jointset/j/q/speed", True),
        (r".*\bq\b.*", "/jointset/j/q/speed", True),
        (r".*\bq\B.*", "/jointset/j/q/speed", False),
        ("[[:alpha:]]+_[lr]", "hip_l", True),
        ("[[:alpha:]]+_[lr]", "hip_x", False),
        (r"\x61\u0062[\d-]", "ab-", True),
        ("a**", "aaa", True),
        ("", "", True),
        ("", "a", False),
    ],
)
def test_syntax_of_ecmascript(text: str, name: str, is_match: bool) -> None:
    assert Pattern(text).fullmatch(name) == is_match


@pytest.mark.parametrize(
    "text", ["(", ")", "a{2", "[a", "\\", "*a", "a{3,2}", "a{99999}", "[b-a]", "[[:no:]]", r"\xzz"]
)
def test_what_is_no_pattern(text: str) -> None:
    with pytest.raises(PatternError) as caught:
        Pattern(text)
    assert not isinstance(caught.value, UnsupportedPatternError)


@pytest.mark.parametrize("text", [r"(a)\1", "(a{100}){100}", "(" * 100, "a" * MAX_STATES])
def test_what_is_not_supported(text: str) -> None:
    with pytest.raises(UnsupportedPatternError):
        Pattern(text)


@pytest.mark.parametrize("words", SLOW[:3])
def test_a_study_with_such_a_pattern_is_checked(words: str, fixtures: Path, tmp_path: Path) -> None:
    from osimlite.lint import validate

    for name in ("slide.osim", "slide_guess.sto", "slide_states.sto"):
        (tmp_path / name).write_bytes((fixtures / "setups" / name).read_bytes())
    text = (fixtures / "setups" / "slide.omoco").read_text()
    info = f'<state_infos_pattern><MocoVariableInfo name="{words}"><bounds>0 1</bounds></MocoVariableInfo>'
    (tmp_path / "slide.omoco").write_text(
        text.replace("<control_infos>", f"{info}</state_infos_pattern><control_infos>")
    )
    begin = time.process_time()
    report = validate(tmp_path / "slide.omoco")
    assert time.process_time() - begin < 20.0
    assert any(words in finding.message for finding in report)


def test_links_to_the_folder_itself_do_not_multiply(tmp_path: Path) -> None:
    for name in ("a", "b", "c"):
        (tmp_path / name).symlink_to(".")
    (tmp_path / "deep").mkdir()
    for place in (tmp_path / "x.xml", tmp_path / "deep" / "y.xml", tmp_path / ".z.xml"):
        place.touch()
    found = find_files(str(tmp_path / "**" / "*.xml"))
    assert [Path(file).name for file in found] == ["y.xml", "x.xml"]
    assert find_files(str(tmp_path / "**" / "**" / "**" / "*.xml")) == found


def test_links_to_other_folders_are_followed(tmp_path: Path) -> None:
    (tmp_path / "data" / "s1").mkdir(parents=True)
    (tmp_path / "data" / "s1" / "ik.xml").touch()
    (tmp_path / "lab").mkdir()
    (tmp_path / "lab" / "subjects").symlink_to("../data")
    assert len(find_files(str(tmp_path / "lab" / "**" / "ik.xml"))) == 1
    assert len(find_files(str(tmp_path / "lab" / "*" / "*" / "ik.xml"))) == 1


def test_a_pattern_looks_at_a_bounded_number_of_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(file_patterns, "MAX_ENTRIES", 10)
    for number in range(11):
        (tmp_path / f"{number}.xml").touch()
    with pytest.raises(OsimliteError, match="write the names of the folders"):
        find_files(str(tmp_path / "*.xml"))


CHAIN = """<OpenSimDocument Version="40600"><AnalyzeTool name="a"><model_file>m.osim</model_file>
<external_loads_file>{0}</external_loads_file><controls_file>{0}</controls_file>
<coordinates_file>{0}</coordinates_file><force_set_files>{0} {0}</force_set_files></AnalyzeTool></OpenSimDocument>"""


@pytest.mark.parametrize("last", ["s0.xml", "none.xml"])
def test_setups_that_name_each_other_are_read_once(
    last: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The setups form 3^30 chains of references, and more if the last one refers to the first."""
    count = 30
    for number in range(count):
        following = f"s{number + 1}.xml" if number + 1 < count else last
        (tmp_path / f"s{number}.xml").write_text(CHAIN.format(following))
    found = {*find_named_files(str(tmp_path / "s0.xml"), "file")}
    assert {str(tmp_path / f"s{number}.xml") for number in range(1, count)} <= found
    from osimlite.tools.running import check_documents

    assert len([*check_documents(str(tmp_path / "s0.xml"), {})]) == count
    monkeypatch.setattr("osimlite.tools.named_files.MAX_DOCUMENTS", 5)
    with pytest.raises(OsimliteError, match="more than 5 documents"):
        [*find_named_files(str(tmp_path / "s0.xml"), "file")]
