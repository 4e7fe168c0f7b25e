"""Tests of SCONE's files: supported settings, and errors with their lines."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.errors import OsimliteError
from osimlite.studies.reflexes.parameters import Parameters, read_par
from osimlite.studies.reflexes.settings import make_node, read_settings


def test_trees_includes_and_constants(tmp_path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "other.scone").write_text(
        "c = $far  # what is included knows the constants\n"
    )
    text = '$far = 0.5 # a comment\na = "two words" b { x = 1 y = [ 1 2 ] }\n<< parts/other.scone >>\nb = q { z = 2 }'
    (tmp_path / "it.scone").write_text(text)
    top = read_settings(tmp_path / "it.scone")
    assert [name for name, _ in top.parts] == ["a", "b", "c", "b"]
    assert top.text("a") == "two words" and top.number("c") == 0.5
    first, second = (node for _, node in top.select_all("b"))
    assert first.number("x") == 1.0 and first.text("y") == "1 2" and first.line == 2
    assert second.value == "q" and second.number("z") == 2.0
    with pytest.raises(OsimliteError, match="does not support 'y' of a b"):
        first.read_keys.clear()
        first.get("x")
        first.refuse_unread_parts("a b")


def test_yaml_and_data_are_the_same_trees(tmp_path) -> None:
    yaml = pytest.importorskip("yaml", reason="needs PyYAML (extra 'yaml')")
    (tmp_path / "other.yaml").write_text("c: 3\n")
    text = 'a: two words\nb:\n  - {x: "~2<0,20>", y: [1, 2]}\n  - {z: true}\ninclude: other.yaml\n'
    (tmp_path / "it.yaml").write_text(text)
    top = read_settings(tmp_path / "it.yaml")
    assert [(name, node.line) for name, node in top.parts] == [
        ("a", 1),
        ("b", 3),
        ("b", 4),
        ("c", 1),
    ]
    first, second = (node for _, node in top.select_all("b"))
    assert first.text("x") == "~2<0,20>" and first.text("y") == "1 2" and second.flag("z", False)
    data = make_node({"a": "two words", "b": [{"x": "~2<0,20>", "y": [1, 2]}, {"z": True}], "c": 3})

    def plain(node):
        return node.value.lower(), [(name, plain(part)) for name, part in node.parts]

    assert plain(data) == plain(top)
    assert yaml.safe_load(text)["a"] == "two words"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: [1", "it.yaml:1:6: not YAML"),
        ("- 1", "expected keys with values"),
        ("a: [{b: 1}, [2]]", "keys with"),
    ],
)
def test_damage_of_yaml_is_told(text, words, tmp_path) -> None:
    pytest.importorskip("yaml", reason="needs PyYAML (extra 'yaml')")
    (tmp_path / "it.yaml").write_text(text)
    with pytest.raises(OsimliteError, match=words):
        read_settings(tmp_path / "it.yaml")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a = $b", "no constant '\\$b'"),
        ("a {", "ends too early"),
        ("a = 1\n}", "line 2: a '}' without"),
        ('a = "b', "quotation mark"),
        ("<< other.scone >>", "no such file"),
        ("a b", "expected '=' or '{' after 'a', found 'b'"),
        ("<< it.scone >>", "endless chain of includes"),
        ("a = {", "expected a value"),
    ],
)
def test_damage_is_told(text, words, tmp_path) -> None:
    (tmp_path / "it.scone").write_text(text)
    with pytest.raises(OsimliteError, match=words):
        read_settings(tmp_path / "it.scone")


@pytest.mark.parametrize(
    ("text", "mean", "std", "low", "high"),
    [
        ("~0.63<0,10>", 0.63, 0.063, 0.0, 10.0),
        ("0~0.01<-0.5,0.5>", 0.0, 0.01, -0.5, 0.5),
        ("~-4", -4.0, 0.4, float("-inf"), float("inf")),
        ("1.5~.2", 1.5, 0.2, float("-inf"), float("inf")),
    ],
)
def test_parameters(text, mean, std, low, high, tmp_path) -> None:
    (tmp_path / "it.scone").write_text(f"a = {text} b = 2")
    top, own = read_settings(tmp_path / "it.scone"), Parameters({"S1.a": np.array([0.1, 20.0])}, 2)
    found = own.get_number(top, "a", 0.0, "S1.a")
    assert found.tolist() == [min(max(value, low), high) for value in (0.1, 20.0)]
    assert own.requested["S1.a"] == pytest.approx(
        ("S1.a", mean, std, low, high)[1:], abs=1e-12
    ) or own.requested["S1.a"][1:] == (pytest.approx((mean, std, low, high)))
    assert own.get_number(top, "b", 0.0).tolist() == [2.0, 2.0] and own.get_number(
        top, "c", 7.0
    ).tolist() == [
        7.0,
        7.0,
    ]


def test_files_of_parameters(tmp_path) -> None:
    (tmp_path / "a.par").write_text("S1.x   1 2 3\n\nS1.y\t-1\t0.5\t0.1\n")
    assert read_par(tmp_path / "a.par") == {"S1.x": (1.0, 2.0, 3.0), "S1.y": (-1.0, 0.5, 0.1)}
    (tmp_path / "a.par").write_text("S1.x 1 2\n")
    with pytest.raises(
        OsimliteError, match="four words: name, best value, mean and standard deviation"
    ):
        read_par(tmp_path / "a.par")


def test_what_parts_are_called_is_nobody_s_business(tmp_path) -> None:
    (tmp_path / "it.scone").write_text(
        "signature_postfix = OS4 name = that signature = it signature_prefix = DATE_TIME x = 1"
    )
    top = read_settings(tmp_path / "it.scone")
    with pytest.raises(OsimliteError, match="does not support 'x' of a model"):
        top.refuse_unread_parts("a model")
    top.get("x")
    top.refuse_unread_parts("a model")
