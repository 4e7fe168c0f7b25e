"""Where mesh files are looked for."""

from __future__ import annotations

from osimlite.meshes.folders import find_file, geometry_folders


def test_folders_are_searched_in_order(tmp_path, monkeypatch):
    monkeypatch.setenv("OSIMLITE_GEOMETRY", f"{tmp_path / 'd'}::{tmp_path / 'e'}")
    folders = geometry_folders(tmp_path / "a", [tmp_path / "b", tmp_path / "c"])
    assert [path.relative_to(tmp_path).as_posix() for path in folders] == ["a", "a/Geometry", "b", "c", "d", "e"]
    for folder in reversed(folders):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "bone.obj").write_text(f"v {folder.name}")
        assert find_file("bone.obj", folders) == folder / "bone.obj"
    assert geometry_folders(None) == folders[-2:]


def test_a_file_spelled_exactly_anywhere_comes_first(tmp_path):
    for folder, name in (("a", "Bone.obj"), ("b", "bone.obj")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / name).write_text("")
    assert find_file("bone.obj", [tmp_path / "a", tmp_path / "b"]) == tmp_path / "b" / "bone.obj"
    assert find_file("BONE.obj", [tmp_path / "a", tmp_path / "b"]) == tmp_path / "a" / "Bone.obj"


def test_absolute_names_parents_and_nonsense(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "bone.obj").write_text("")
    assert find_file(str(tmp_path / "bone.obj"), []) == tmp_path / "bone.obj"
    assert find_file("../bone.obj", [tmp_path / "a"]) == tmp_path / "a" / ".." / "bone.obj"
    for name in ("", ".", "..", "a", "\0", "x" * 5000, "C:\\Geometry\\bone.obj", str(tmp_path / "gone.obj")):
        assert find_file(name, [tmp_path, tmp_path / "none"]) is None
