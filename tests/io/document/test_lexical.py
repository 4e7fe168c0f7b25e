"""Check the lexical rules of xml_format.md: which values OpenSim 4.6 reads from a text."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.io.document.lexical import (
    ABSENT,
    UncleanText,
    format_17_digits,
    format_shortest,
    make_converter,
    make_formatter,
    parse_real,
    split_words,
)
from osimlite.schema.fields import Value

SINGLE = Value("double")
VEC3 = Value("double", "Vec3")
RANGE = Value("double", "list", least=2, most=2)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1.0),
        (" +2.5e0\n", 2.5),
        (".5", 0.5),
        ("5.", 5.0),
        ("-1e-400", -0.0),
        ("inf", math.inf),
        ("-Infinity", -math.inf),
    ],
)
def test_numbers(text: str, value: float) -> None:
    assert make_converter(SINGLE)(text) == value


def test_nan_in_any_case() -> None:
    assert all(math.isnan(make_converter(SINGLE)(text)) for text in ("NaN", "nan", "NAN"))


@pytest.mark.parametrize(
    ("text", "trouble", "value"),
    [
        ("1,5", "cut", 1.0),
        ("5kg", "cut", 5.0),
        ("0x10", "cut", 0.0),
        ("1d3", "cut", 1.0),
        ("1_000", "cut", 1.0),
        ("1/3", "cut", 1.0),
        ("abc", "unreadable", ABSENT),
        ("1e400", "unreadable", ABSENT),
        ("", "empty", ABSENT),
        ("5 6", "too-many", 5.0),
        ("5 6 a", "unreadable", ABSENT),
        ("5e", "unreadable", ABSENT),
    ],
)
def test_numbers_that_lose_something(text: str, trouble: str, value: object) -> None:
    with pytest.raises(UncleanText) as caught:
        make_converter(SINGLE)(text)
    assert (caught.value.trouble, caught.value.value) == (trouble, value)


@pytest.mark.parametrize(
    ("text", "trouble", "value"),
    [
        ("0 -0.2175", "too-few", ABSENT),
        ("0 -0.2175 0 5", "too-many", ABSENT),
        ("1 2 3 4 5 6", "too-many", (1.0, 2.0, 3.0)),
        ("0,-0.2175,0", "too-few", ABSENT),
        ("0 abc 0", "unreadable", ABSENT),
        ("0, 1,5 0", "unreadable", (0.0, 1.0, 0.0)),
        ("(0 -0.2175 0)", "unreadable", ABSENT),
        ("", "empty", ABSENT),
    ],
)
def test_vectors_that_are_dropped(text: str, trouble: str, value: object) -> None:
    with pytest.raises(UncleanText) as caught:
        make_converter(VEC3)(text)
    assert (caught.value.trouble, caught.value.value) == (trouble, value)


def test_white_space_of_any_kind_separates() -> None:
    assert make_converter(VEC3)("\n\t0\n-0.2175\t 0\r\n") == (0.0, -0.2175, 0.0)


def test_only_ascii_counts_as_digits_and_white_space() -> None:
    # Word processors insert no-break spaces and full-width digits; OpenSim keeps the default value.
    for raw in ("0\u00a0-5 0", "0 -\uff15 0", "\u200b0 -5 0", "0 \u22125 0"):
        with pytest.raises(UncleanText) as caught:
            make_converter(VEC3)(raw)
        assert caught.value.value is ABSENT
    with pytest.raises(UncleanText):
        make_converter(SINGLE)("\uff15")
    assert make_converter(Value("string"))("a\u00a0b  c") == "a\u00a0b c"
    assert split_words("x\u00a0 y") == ["x\u00a0", "y"]


def test_a_range_takes_two() -> None:
    assert make_converter(RANGE)("-1 1") == (-1.0, 1.0)
    with pytest.raises(UncleanText) as caught:
        make_converter(RANGE)("-1 0 1")
    assert caught.value.value == (-1.0, 0.0)
    with pytest.raises(UncleanText) as caught:
        make_converter(RANGE)("0")
    assert caught.value.value is ABSENT


@pytest.mark.parametrize(
    ("text", "trouble", "value"),
    [
        ("1,5 2", "cut", (1.0, 2.0)),
        ("1 2x", "cut", (1.0, 2.0)),
        ("1x 2 3", "cut", (1.0, 2.0)),
        ("1x", "too-few", ABSENT),
        ("1 abc", "unreadable", ABSENT),
        ("1 2 abc", "unreadable", ABSENT),
    ],
)
def test_of_every_word_of_a_list_the_number_it_begins_with_counts(
    text: str, trouble: str, value: object
) -> None:
    with pytest.raises(UncleanText) as caught:
        make_converter(RANGE)(text)
    assert (caught.value.trouble, caught.value.value) == (trouble, value)


@pytest.mark.parametrize(
    ("text", "value"), [("true", True), ("True", True), ("1", True), ("FALSE", False), ("0", False)]
)
def test_switches(text: str, value: bool) -> None:
    assert make_converter(Value("bool"))(text) is value


def test_switches_know_no_other_word() -> None:
    with pytest.raises(UncleanText):
        make_converter(Value("bool"))("yes")


def test_legacy_switches_are_false_unless_true() -> None:
    assert make_converter(Value("bool", legacy=True))("TRUE") is True
    assert make_converter(Value("bool", legacy=True))("0") is False
    with pytest.raises(UncleanText) as caught:
        make_converter(Value("bool", legacy=True))("1")
    assert caught.value.value is False


def test_whole_numbers_are_consumed_entirely() -> None:
    assert make_converter(Value("int"))("-3") == -3
    for text in ("3.0", "1e1", "3_0"):
        with pytest.raises(UncleanText):
            make_converter(Value("int"))(text)


def test_texts_collapse_white_space() -> None:
    assert make_converter(Value("string"))("  a \n\t b ") == "a b"


def test_legacy_lists_take_commas_and_brackets() -> None:
    assert make_converter(Value("double", "list", legacy=True))("(1, 2,3)") == (1.0, 2.0, 3.0)


def test_legacy_lists_of_switches_are_false_but_for_true_in_small_letters() -> None:
    flags = make_converter(Value("bool", "list", legacy=True))
    assert flags("true false 0") == (True, False, False)
    with pytest.raises(UncleanText) as caught:
        flags("true 1 TRUE")
    assert (caught.value.trouble, caught.value.word, caught.value.value) == (
        "ignored",
        "1",
        (True, False, False),
    )


@pytest.mark.parametrize("text", ["1x 2", "1 2mm", "1.5kg"])
def test_legacy_lists_of_numbers_with_something_behind_one_are_refused(text: str) -> None:
    with pytest.raises(UncleanText) as caught:
        make_converter(Value("double", "list", legacy=True))(text)
    assert (caught.value.trouble, caught.value.value) == ("unreadable", ABSENT)


@given(st.floats())
def test_both_spellings_of_a_number_read_back_equal(value: float) -> None:
    for spelling in (format_shortest(value), format_17_digits(value)):
        back = parse_real(spelling)
        assert back == value or (math.isnan(back) and math.isnan(value))
        assert math.copysign(1.0, back) == math.copysign(1.0, value) or math.isnan(value)


@given(
    st.lists(st.floats(allow_nan=False), max_size=6),
    st.sampled_from(["shortest", "opensim"]),
    st.booleans(),
)
def test_lists_read_back_equal(values: list[float], numbers: str, legacy: bool) -> None:
    kind = Value("double", "list", legacy=legacy)
    text = make_formatter(kind, numbers)(tuple(values))
    assert make_converter(kind)(text) == tuple(values)


def test_spelling_of_opensim() -> None:
    print_number = make_formatter(SINGLE, "opensim")
    assert [print_number(v) for v in (0.1, 1e-9, 1e20, -0.0, 1.0)] == [
        "0.10000000000000001",
        "1.0000000000000001e-09",
        "1e+20",
        "-0",
        "1",
    ]
    assert [format_shortest(v) for v in (0.1, 1e-9, 1.0, math.inf, math.nan)] == [
        "0.1",
        "1e-09",
        "1",
        "Inf",
        "NaN",
    ]


def test_legacy_lists_print_six_digits_only_where_they_suffice() -> None:
    legacy = make_formatter(Value("double", "list", legacy=True), "opensim")
    assert legacy((0.1, 0.333333, 1e-9)) == " 0.1 0.333333 1e-09"
    assert legacy((1 / 3,)) == " 0.33333333333333331"
