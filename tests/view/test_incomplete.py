"""Tests of models with one wrong reference: they are shown, and messages name what is left out."""

from __future__ import annotations

import gzip
import json
import re
from collections import Counter
from pathlib import Path

import pytest

import osimlite
from osimlite.errors import ModelError
from osimlite.view import ModelView, incomplete
from osimlite.view.incomplete import MAX_REMARKS, MAX_SAME, build_showable, describe_left_out
from tests.cli.command import run


@pytest.fixture
def text(fixtures: Path) -> str:
    return (fixtures / "walker" / "DynamicWalkerModel.osim").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("/bodyset/RightShank<", "/bodyset/Nowhere<", "not shown: /jointset/RightShankToThigh: "),
        (
            "<socket_child_frame>Platform",
            "<socket_child_frame>x",
            "not shown: /jointset/PlatformToGround: ",
        ),
        ("<geometry>RFootContact ", "<geometry>RFootContct ", "error: /forceset/RFootForce: "),
        (
            "/bodyset/LeftShank</socket_frame>",
            "/bodyset/Nobody</socket_frame>",
            "not shown: /contactgeometryset/",
        ),
    ],
)
def test_one_wrong_reference_leaves_the_rest(
    text: str, tmp_path: Path, old: str, new: str, said: str
) -> None:
    assert old in text
    (tmp_path / "m.osim").write_text(text.replace(old, new, 1), encoding="utf-8")
    done = run("view", "m.osim", "--html", "m.html", folder=tmp_path)
    assert done.code == 0, done.err
    assert said in done.out and "did you mean" in done.out
    (data,) = re.findall(
        r'id="data">(.*?)</script>', (tmp_path / "m.html").read_text(encoding="utf-8")
    )
    assert "LeftThigh" in json.dumps(json.loads(data))


@pytest.mark.parametrize("name", ["whole", "wrong reference", "muscles"])
def test_the_page_has_the_findings_of_validate(
    fixtures: Path, text: str, tmp_path: Path, name: str
) -> None:
    if name == "muscles":
        text = gzip.decompress((fixtures / "setups" / "model.osim.gz").read_bytes()).decode()
    if name == "wrong reference":
        text = text.replace("/bodyset/RightShank<", "/bodyset/Nowhere<", 1)
    (tmp_path / "m.osim").write_text(text, encoding="utf-8")
    # The settings of a project apply to both commands.
    (tmp_path / "osimlite.toml").write_text('ignore = ["OSIM508"]\n', encoding="utf-8")
    # Neither command finds the meshes of bones here.
    checked = run("validate", "m.osim", "--format", "json", folder=tmp_path)
    done = run("view", "m.osim", "--html", "m.html", folder=tmp_path)
    assert done.code == 0, done.err
    page = (tmp_path / "m.html").read_text(encoding="utf-8")
    (data,) = re.findall(r'id="data">(.*?)</script>', page)
    shown = _count(json.loads(data)["findings"])
    assert shown == _count(json.loads(checked.out))
    assert shown or name == "whole"


def _count(rows: list[dict[str, str]]) -> Counter[tuple[str, str, str]]:
    return Counter((row["code"], row["severity"], row["component"]) for row in rows)


def test_a_model_in_memory_has_the_findings_of_its_left_out_parts(
    text: str, tmp_path: Path
) -> None:
    path = tmp_path / "m.osim"
    path.write_text(text.replace("/bodyset/RightShank<", "/bodyset/Nowhere<", 1), encoding="utf-8")
    model = osimlite.read(path)
    codes = [finding.code for finding in ModelView.from_model(model).findings]
    assert "OSIM301" in codes and codes == [item.code for item in osimlite.validate(model).findings]


def test_a_copy_loses_its_part_and_not_the_model(text: str, tmp_path: Path) -> None:
    path = tmp_path / "m.osim"
    path.write_text(text.replace("/bodyset/RightShank<", "/bodyset/Nowhere<", 1), encoding="utf-8")
    model = osimlite.read(path)
    before = osimlite.to_text(model)
    shown = build_showable(model)
    assert [part for part, _ in shown.left_out] == ["/jointset/RightShankToThigh"]
    assert osimlite.to_text(model) == before and shown.model is not model
    assert shown.mechanism.coordinate_names


def test_a_fault_of_no_single_part_stays_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(model: osimlite.Model) -> None:
        raise ModelError("the model '/bodyset/nobody' is too heavy")

    monkeypatch.setattr(incomplete, "build_mechanism", refuse)
    with pytest.raises(ModelError, match="too heavy"):
        build_showable(osimlite.Model(name="m"))


def test_many_parts_are_counted() -> None:
    parts = [(f"/a/{number}", f"fault {number} is in it") for number in range(MAX_REMARKS + 3)]
    meshes = [
        ("/b/1", "the mesh file x.vtp is missing"),
        ("/b/2", "the mesh file y.vtp is missing"),
    ]
    lines = [*describe_left_out([*parts, *meshes])]
    assert len(lines) == MAX_REMARKS + 2 and lines[-2] == "not shown: 3 more parts"
    assert lines[-1] == "not shown: /b/1 (and 1 similar part): the mesh file x.vtp is missing"


def test_parts_with_the_same_reason_are_one_sentence() -> None:
    reason = "is a FunctionBasedPath, which has no points"
    parts = [(f"/a/{number}", reason) for number in range(MAX_SAME + 1)]
    assert [*describe_left_out([parts[0], ("/b", "is wrong"), *parts[1:]])] == [
        f"not shown: /a/0 (and {MAX_SAME} similar parts): {reason}",
        "not shown: /b: is wrong",
    ]
