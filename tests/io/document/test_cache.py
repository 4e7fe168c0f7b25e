"""Check that parsed documents are cached while their files do not change."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import osimlite
from osimlite.errors import DocumentError
from osimlite.io.document import cache
from osimlite.io.document.reader import Document, read_document
from osimlite.io.document.source import Source
from osimlite.schema.base import Object
from osimlite.schema.frames import Body, BodySet
from osimlite.schema.model import Model
from osimlite.schema.tools.scale import ScaleTool


@pytest.fixture
def file(tmp_path: Path) -> Path:
    osimlite.write(
        Model(name="m", body_set=BodySet(objects=[Body(name="thigh", mass=3.25)])),
        tmp_path / "model.osim",
    )
    return tmp_path / "model.osim"


def reads(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return a list that grows by the name of each file that is read from now on."""
    seen: list[str] = []

    def noted(source: Source, *, of: type[Object]) -> Document:
        seen.append(str(source.file))
        return read_document(source, expected_class=of)

    monkeypatch.setattr("osimlite.io.document.cache.read_document", noted)
    return seen


def test_what_is_known_is_copied(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = osimlite.to_text(osimlite.read(file))
    cache.get_object(f"{file.parent}/./{file.name}")
    seen = reads(monkeypatch)
    for _ in range(2):
        model = cache.read_copy(file, Model)
        assert osimlite.to_text(model) == text
        assert model.layout is not None and model.layout.file == str(file)
        body = model.body_set.objects[0]
        assert body.model is model and body.path == f"/bodyset/{body.name}"
        body.mass += 1.0
    assert not seen


def test_another_file_in_its_place_is_read(file: Path, tmp_path: Path) -> None:
    cache.get_object(str(file))
    before, other = os.stat(file), tmp_path / "other.osim"
    other.write_text(file.read_text().replace("3.25", "4.75"))
    os.utime(other, ns=(before.st_atime_ns, before.st_mtime_ns))
    other.replace(file)
    assert (os.stat(file).st_mtime_ns, os.stat(file).st_size) == (
        before.st_mtime_ns,
        before.st_size,
    )
    assert cache.read_copy(file, Model).body_set.objects[0].mass == 4.75


def test_parts_in_other_files_are_read_again(tmp_path: Path) -> None:
    part = tmp_path / "forces.xml"
    part.write_text(
        '<OpenSimDocument Version="40600"><ForceSet name="f"><objects><BushingForce name="one"/></objects></ForceSet>'
        "</OpenSimDocument>"
    )
    file = tmp_path / "model.osim"
    file.write_text(
        '<OpenSimDocument Version="40600"><Model name="m"><ForceSet file="forces.xml"/></Model></OpenSimDocument>'
    )
    cache.get_object(str(file))
    assert [force.name for force in cache.read_copy(file, Model).force_set.objects] == ["one"]
    part.write_text(part.read_text().replace("one", "two"))
    assert [force.name for force in cache.read_copy(file, Model).force_set.objects] == ["two"]


def test_what_is_not_asked_for_is_refused_as_always(file: Path, tmp_path: Path) -> None:
    cache.get_object(str(file))
    with pytest.raises(DocumentError, match="a <Model>, not a <ScaleTool>"):
        cache.read_copy(file, ScaleTool)
    with pytest.raises(DocumentError, match="no such file"):
        cache.read_copy(tmp_path / "none.osim", Model)


def test_a_file_is_the_same_by_every_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def make(path: str) -> str:
        seen.append(path)
        return Path(path).read_text()

    known = cache.cache_by_file(2)(make)
    (tmp_path / "one.txt").write_text("one")
    monkeypatch.chdir(tmp_path)
    assert known("one.txt") == known("./one.txt") == known(str(tmp_path / "one.txt")) == "one"
    assert seen == ["one.txt"] and known.has("./one.txt")
    # In another folder the same relative path names another file.
    (tmp_path / "inner").mkdir()
    (tmp_path / "inner" / "one.txt").write_text("another")
    monkeypatch.chdir(tmp_path / "inner")
    assert known("one.txt") == "another" and known("../one.txt") == "one" and len(seen) == 2


def test_what_somebody_else_has_made_is_kept(tmp_path: Path) -> None:
    known = cache.cache_by_file(1)(lambda path: Path(path).read_text())
    files = [tmp_path / "one.txt", tmp_path / "two.txt"]
    for each in files:
        each.write_text("read")
        known.keep(str(each), "kept")
    assert [known.has(str(each)) for each in files] == [False, True]
    assert known(str(files[1])) == "kept"
    files[1].write_text("something else")
    assert known(str(files[1])) == "something else"
    known.keep(str(tmp_path / "nothing.txt"), "kept")
    assert known(str(tmp_path / "nothing.txt")) is None


@pytest.mark.parametrize("tag", ["mass", "masss"])
def test_a_misspelt_property_of_a_known_document_is_reported(tmp_path: Path, tag: str) -> None:
    file = tmp_path / "scale.xml"
    file.write_text(
        f'<OpenSimDocument Version="40600"><ScaleTool name="s"><{tag}>60</{tag}></ScaleTool></OpenSimDocument>'
    )
    document = read_document(Source.from_file(file), expected_class=Object)
    cache.keep_object(str(file), document.top, document.notes)
    if tag == "mass":
        copied = cache.read_object(file, ScaleTool)
        assert copied == document.top
        assert copied is not document.top
    else:
        with pytest.raises(DocumentError, match="did you mean <mass>"):
            cache.read_object(file, ScaleTool)
