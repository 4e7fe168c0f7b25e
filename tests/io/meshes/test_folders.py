"""Check in which folders mesh files are searched, and from which they must not be read."""

from __future__ import annotations

from pathlib import Path

import pytest

from osimlite.io.meshes.folders import MeshFolders, OutsideError


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """Return the folder of a model, with a private mesh in a neighbouring folder."""
    (tmp_path / "model").mkdir()
    (tmp_path / "private").mkdir()
    (tmp_path / "private" / "bone.obj").write_text("v 0 0 0")
    return tmp_path / "model"


def test_folders_are_searched_in_order(tmp_path, monkeypatch):
    monkeypatch.setenv("OSIMLITE_GEOMETRY", f"{tmp_path / 'd'}::{tmp_path / 'e'}")
    folders = MeshFolders(tmp_path / "a", [tmp_path / "b", tmp_path / "c"])
    searched = folders.searched
    assert [path.relative_to(tmp_path).as_posix() for path in searched] == [
        "a",
        "a/Geometry",
        "b",
        "c",
        "d",
        "e",
    ]
    for folder in reversed(searched):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "bone.obj").write_text(f"v {folder.name}")
        assert folders.find("bone.obj") == folder / "bone.obj"
    assert MeshFolders().searched == searched[-2:]


def test_a_file_spelled_exactly_anywhere_comes_first(tmp_path):
    for folder, name in (("a", "Bone.obj"), ("b", "bone.obj")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / name).write_text("")
    folders = MeshFolders(tmp_path / "a", [tmp_path / "b"])
    assert folders.find("bone.obj") == tmp_path / "b" / "bone.obj"
    assert folders.find("BONE.obj") == tmp_path / "a" / "Bone.obj"


def test_names_of_nothing(tmp_path):
    (tmp_path / "a").mkdir()
    folders = MeshFolders(tmp_path, [tmp_path / "none"])
    for name in (
        "",
        ".",
        "..",
        "a",
        "\0",
        "x" * 5000,
        "C:\\Geometry\\bone.obj",
        str(tmp_path / "gone.obj"),
    ):
        assert folders.find(name) is None


def _absolute(model: Path) -> str:
    return str(model.parent / "private" / "bone.obj")


def _above(model: Path) -> str:
    return "../private/bone.obj"


def _above_in_other_capitals(model: Path) -> str:
    return "..\\PRIVATE\\Bone.OBJ"


def _down_and_up(model: Path) -> str:
    (model / "down").mkdir()
    return "down/../../private/bone.obj"


def _linked_file(model: Path) -> str:
    (model / "own.obj").symlink_to(model.parent / "private" / "bone.obj")
    return "own.obj"


def _linked_twice(model: Path) -> str:
    (model / "Geometry").mkdir()
    (model / "Geometry" / "first.obj").symlink_to("../second.obj")
    (model / "second.obj").symlink_to("../private/bone.obj")
    return "first.obj"


def _linked_folder(model: Path) -> str:
    (model / "bones").symlink_to(model.parent / "private")
    return "bones/bone.obj"


def _linked_geometry(model: Path) -> str:
    (model / "Geometry").symlink_to(model.parent / "private")
    return "bone.obj"


@pytest.mark.parametrize(
    "lure",
    [
        _absolute, _above, _above_in_other_capitals, _down_and_up,
        _linked_file, _linked_twice, _linked_folder, _linked_geometry,
    ],
)  # fmt: skip
def test_files_outside_are_refused_by_name_unless_their_folder_is_named(model, lure):
    name, private = lure(model), model.parent / "private"
    with pytest.raises(OutsideError, match="--geometry") as caught:
        MeshFolders(model).find(name)
    assert name in str(caught.value) and str(private) in str(caught.value)
    result = MeshFolders(model, [private]).find(name)
    assert result is not None and result.samefile(private / "bone.obj")


def test_names_that_lead_around_inside_are_taken(model):
    (model / "bone.obj").write_text("")
    (model / "again.obj").symlink_to("bone.obj")
    for name in (str(model / "bone.obj"), "../model/bone.obj", "again.obj", "./bone.obj"):
        result = MeshFolders(model).find(name)
        assert result is not None and result.samefile(model / "bone.obj")


def test_a_folder_that_is_named_may_itself_be_a_link(model):
    (model / "Geometry").symlink_to(model.parent / "private")
    folders = MeshFolders(model, [model / "Geometry"])
    assert folders.find("bone.obj") == model / "Geometry" / "bone.obj"


def test_a_file_inside_is_taken_before_one_outside(model):
    (model / "bone.obj").symlink_to(model.parent / "private" / "bone.obj")
    (model / "Geometry").mkdir()
    (model / "Geometry" / "bone.obj").write_text("")
    assert MeshFolders(model).find("bone.obj") == model / "Geometry" / "bone.obj"


def test_the_working_folder_is_a_folder_as_any(model, monkeypatch):
    (model / "bone.obj").write_text("")
    monkeypatch.chdir(model)
    assert MeshFolders(Path(".")).find("bone.obj") == Path("bone.obj")
    with pytest.raises(OutsideError):
        MeshFolders(Path(".")).find("../private/bone.obj")
