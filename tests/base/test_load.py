"""Tests of running Python files that a user names: the current text is run, and no compiled files are left behind."""

from __future__ import annotations

import os
import py_compile
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from osimlite.base.load import import_user_module, run_python_file
from osimlite.models.source import make_model
from tests.cli.command import run

SECOND = 1_700_000_000


@pytest.fixture(autouse=True)
def as_users_have_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Let Python write compiled files, as it does by default, even where the environment of the tests forbids it."""
    monkeypatch.delenv("PYTHONDONTWRITEBYTECODE", raising=False)
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    for name in ("path", "meta_path"):
        monkeypatch.setattr(sys, name, [*getattr(sys, name)])
    yield
    for name, module in [*sys.modules.items()]:
        if str(getattr(module, "__file__", None)).startswith(str(tmp_path)):
            del sys.modules[name]


def write(place: Path, text: str) -> None:
    """Write a file with a fixed modification time, so that Python cannot tell two versions of equal size apart."""
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text(text)
    os.utime(place, (SECOND, SECOND))


def left_in(folder: Path) -> list[str]:
    return [
        path.name
        for path in folder.rglob("*")
        if path.name == "__pycache__" or path.suffix == ".pyc"
    ]


def test_a_file_is_run_as_it_is_now(tmp_path: Path) -> None:
    for number in (1, 2):
        write(tmp_path / "mine.py", f"value = {number}\n")
        assert run_python_file(tmp_path / "mine.py").value == number
    assert not left_in(tmp_path)


@pytest.mark.parametrize(
    ("statement", "file"),
    [
        ("from helper import value", "helper.py"),
        ("from kit import value", "kit/__init__.py"),
        ("from kit.deep.part import value", "kit/deep/part.py"),
        ("import kit.part as part; value = part.value", "kit/part.py"),
    ],
)
def test_what_it_imports_from_beside_as_well(tmp_path: Path, statement: str, file: str) -> None:
    write(tmp_path / "mine.py", statement)
    for number in (1, 2):
        write(tmp_path / file, f"value = {number}\n")
        assert run_python_file(tmp_path / "mine.py").value == number
    assert not left_in(tmp_path)


def test_what_python_has_kept_before_does_not_count(tmp_path: Path) -> None:
    write(tmp_path / "mine.py", "from helper import value\n")
    write(tmp_path / "helper.py", "value = 1\n")
    py_compile.compile(str(tmp_path / "helper.py"))
    write(tmp_path / "helper.py", "value = 2\n")
    assert run_python_file(tmp_path / "mine.py").value == 2


def test_files_of_one_name_in_two_folders(tmp_path: Path) -> None:
    for number in (1, 2):
        folder = tmp_path / str(number)
        write(folder / "mine.py", "from helper import value\n")
        write(folder / "helper.py", f"value = {number}\n")
        assert run_python_file(folder / "mine.py").value == number


def test_a_folder_without_init_gives_way_to_another_of_its_name(tmp_path: Path) -> None:
    files = (("first", "kit/part.py", "kit.part"), ("second", "kit/__init__.py", "kit"))
    for number, (folder, file, module) in enumerate((*files, files[0], files[0])):
        write(tmp_path / folder / "mine.py", f"from {module} import value\n")
        write(tmp_path / folder / file, f"value = {number}\n")
        assert run_python_file(tmp_path / folder / "mine.py").value == number


def test_a_module_of_the_current_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, file in (("mine", "mine.py"), ("kit.mine", "kit/mine.py")):
        for number in (1, 2):
            write(tmp_path / file, f"value = {number}\n")
            assert import_user_module(name).value == number
    assert not left_in(tmp_path)


def test_what_is_installed_in_the_folder_is_left_to_python(tmp_path: Path) -> None:
    installed = tmp_path / ".venv" / "site-packages"
    write(installed / "tool" / "__init__.py", "from tool.part import value\n")
    write(installed / "tool" / "part.py", "value = 1\n")
    sys.path.append(str(installed))
    write(tmp_path / "mine.py", "from tool import value\n")
    assert run_python_file(tmp_path / "mine.py").value == 1
    assert len(left_in(installed)) == 3
    first = sys.modules["tool.part"]
    run_python_file(tmp_path / "mine.py")
    assert sys.modules["tool.part"] is first


MODEL = """import osimlite
def make():
    from helper import mass
    model = osimlite.Model(name="m")
    model.add(osimlite.Body(name="b", mass=mass, inertia=(1, 1, 1, 0, 0, 0)))
    return model
"""


def test_the_model_is_the_one_that_is_written_there(tmp_path: Path) -> None:
    write(tmp_path / "mine.py", MODEL)
    for mass in (3.0, 4.0):
        write(tmp_path / "helper.py", f"mass = {mass}\n")
        assert make_model(str(tmp_path / "mine.py")).body_set.objects[0].mass == mass


@pytest.mark.parametrize("source", ["mine.py", "mine:make"])
def test_built_twice_within_a_second(tmp_path: Path, source: str) -> None:
    write(tmp_path / "helper.py", "mass = 3.0\n")
    for mass in ("3.0", "4.0"):
        write(
            tmp_path / "mine.py",
            MODEL.replace("from helper import mass", f"import helper; mass = {mass}"),
        )
        done = run("build", source, "-o", "m.osim", folder=tmp_path)
        assert done.code == 0, done.err
        assert f"<mass>{mass[0]}</mass>" in (tmp_path / "m.osim").read_text()
    assert not left_in(tmp_path)
