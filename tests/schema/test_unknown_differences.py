"""Check that objects of unknown classes are compared by their values."""

from __future__ import annotations

import pytest

from osimlite.io.document.reader import read_text
from osimlite.schema.difference import find_differences
from tests.lint.verdict_cases import small_model

LIGAMENT = (
    '<MyLigament name="l"><stiffness> 100 </stiffness><points><P name="a"><at>0 0.1 0</at></P>'
    '<P name="b"><at>1 2 3</at></P></points><kind unit="m">x</kind></MyLigament>'
)


def compare(new: str) -> list[tuple[str, str | None, str | None]]:
    """Return the differences between a model with a ligament and one with another text in its place."""
    old_model, new_model = (read_text(small_model(forces=text)) for text in (LIGAMENT, new))
    return [(item.what, item.old, item.new) for item in find_differences(old_model, new_model)]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (" 100 ", "100"),
        (" 100 ", "1e2"),
        ("0 0.1 0", "0  0.10\n0.0"),
        ("<points>", "<!-- of the knee --><points>\n"),
    ],
)
def test_layout_and_spelling_are_no_difference(old: str, new: str):
    assert compare(LIGAMENT.replace(old, new)) == []


def test_only_what_changed_is_named():
    assert compare(LIGAMENT.replace("0.1", "0.2")) == [("points.P[a].at", "0 0.1 0", "0 0.2 0")]
    assert compare(LIGAMENT.replace('unit="m"', 'unit="mm"')) == [("kind@unit", "m", "mm")]
    assert compare(LIGAMENT.replace("<stiffness> 100 </stiffness>", "")) == [
        ("stiffness", "100", None)
    ]


def test_a_format_of_a_real_case_is_no_difference(shared):
    import osimlite

    folder = shared / "cases" / "model-24-diff-of-plugin-whitespace"
    old, new = (osimlite.read(folder / name) for name in ("plugin.osim", "f_plugin.osim"))
    assert find_differences(old, new) == []
