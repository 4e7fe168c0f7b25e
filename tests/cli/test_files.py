"""Tests of ``build``, ``format``, ``diff`` and ``info`` on the command line."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import osimlite
from tests.cli.command import run


def test_build_writes_the_walker(tmp_path: Path) -> None:
    code, out, _ = run("build", "dynamic-walker", folder=tmp_path)
    assert code == 0 and "DynamicWalkerModel.osim" in out
    assert osimlite.read(tmp_path / "DynamicWalkerModel.osim").name == "DynamicWalkerModel"
    # Both commands count the components of the file, without those that OpenSim adds itself.
    (count,) = re.findall(r"(\d+) components", out)
    info = run("info", "DynamicWalkerModel.osim", folder=tmp_path).out
    assert re.search(rf"^components +{count} in the file$", info, re.MULTILINE)


def test_build_lists_models_and_takes_parameters(tmp_path: Path) -> None:
    code, out, _ = run("build", "--list")
    assert code == 0 and out.split()[0] == "dynamic-walker" and "()" not in out
    code, _, error = run("build", "dynamic-walker", "-o", "w.omoco", folder=tmp_path)
    assert (
        code == 2
        and "name the model's file, w.osim" in error
        and not (tmp_path / "w.omoco").exists()
    )
    code, _, _ = run(
        "build", "dynamic-walker", "-p", "thigh_length=0.42", "-o", "w.osim", folder=tmp_path
    )
    assert code == 0
    contact = osimlite.read(tmp_path / "w.osim")["/contactgeometryset/RKneeContact"]
    assert contact.location == (0.0, 0.21, 0.0)


def test_build_takes_a_file_of_the_user(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "import osimlite\n"
        "def helper(): pass\n"
        "def pendulum(mass: float = 1.0) -> osimlite.Model:\n"
        "    model = osimlite.Model(name='pendulum')\n"
        "    bob = model.add(osimlite.Body(name='bob', mass=mass, inertia=(1, 1, 1, 0, 0, 0)))\n"
        "    model.add(osimlite.PinJoint(name='pin').between(model.ground, bob, child_at=(0.0, 1.0, 0.0)))\n"
        "    return model\n"
    )
    code, _, error = run("build", "mine.py", "-p", "mass=3", "-o", "p.osim", folder=tmp_path)
    assert code == 0, error
    assert osimlite.read(tmp_path / "p.osim")["/bodyset/bob"].mass == 3.0
    code, _, error = run(
        "build", "mine.py:pendulum", "-p", "mas=3", "-o", "q.osim", folder=tmp_path
    )
    assert code == 2 and "did you mean 'mass'" in error
    code, _, error = run("build", "mine.py", "-p", "mass=heavy", "-o", "q.osim", folder=tmp_path)
    assert code == 2 and "must be a number" in error
    assert not (tmp_path / "q.osim").exists()


def test_build_writes_nothing_if_the_model_has_an_error(tmp_path: Path) -> None:
    (tmp_path / "bad.py").write_text(
        "import osimlite\n"
        "def bad() -> osimlite.Model:\n"
        "    model = osimlite.Model(name='bad')\n"
        "    model.add(osimlite.ContactSphere(name='s', radius=0.1, socket_frame='/bodyset/nowhere'))\n"
        "    return model\n"
    )
    code, _, error = run("build", "bad.py", "-o", "bad.osim", folder=tmp_path)
    assert code == 1 and "nowhere" in error
    assert not (tmp_path / "bad.osim").exists()


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("dynamic-wlker", "did you mean 'dynamic-walker'"),
        ("no.py", "no such file"),
        ("no.such:thing", "cannot import"),
    ],
)
def test_build_names_what_is_missing(source: str, words: str) -> None:
    code, _, error = run("build", source)
    assert code == 2 and words in error


def test_format_is_stable_and_keeps_comments(fixtures: Path, tmp_path: Path) -> None:
    text = (fixtures / "walker" / "DynamicWalkerModel.osim").read_text()
    text = text.replace("<OpenSimDocument", "<!-- ours -->\n<OpenSimDocument", 1)
    text = text.replace("<gravity>", "<!-- as on earth -->\n<gravity>", 1)
    file = tmp_path / "m.osim"
    file.write_text(text)
    code, out, _ = run("format", "--check", "m.osim", folder=tmp_path)
    assert code == 1 and "would reformat" in out and file.read_text() == text
    code, out, _ = run("format", "--diff", "m.osim", folder=tmp_path)
    assert code == 1 and "+++ m.osim (formatted)" in out and file.read_text() == text
    assert run("format", ".", folder=tmp_path)[0] == 0
    formatted = file.read_text()
    assert "<!-- ours -->" in formatted and "<!-- as on earth -->" in formatted
    assert "<!--The mass of the body (kg)-->" not in formatted
    assert run("format", "--check", "m.osim", folder=tmp_path)[:2] == (0, "")
    assert osimlite.read_text(text) == osimlite.read(file)


def test_a_file_of_an_older_format_stays_one(tmp_path: Path) -> None:
    file = tmp_path / "old.osim"
    file.write_text(
        '<OpenSimDocument Version="20302"><Model name="m"><gravity> 0 -9.810 0\n</gravity></Model></OpenSimDocument>'
    )
    assert run("format", "--check", "old.osim", folder=tmp_path)[:2] == (
        1,
        "would reformat old.osim\n",
    )
    assert run("format", "old.osim", folder=tmp_path)[:2] == (0, "reformatted old.osim\n")
    assert (
        'Version="20302"' in file.read_text()
        and "\t\t<gravity>0 -9.810 0</gravity>\n" in file.read_text()
    )
    assert run("format", "--check", "old.osim", folder=tmp_path)[:2] == (0, "")


def test_diff(fixtures: Path, tmp_path: Path) -> None:
    old = str(fixtures / "walker" / "DynamicWalkerModel.osim")
    new = str(tmp_path / "new.osim")
    model = osimlite.read(old)
    osimlite.write(model, new)
    assert run("diff", old, new) == (0, "", "")
    model["/bodyset/Pelvis"].mass = 2.0
    osimlite.write(model, new)
    assert run("diff", old, new)[:2] == (1, "  /bodyset/Pelvis\n    mass: 1 -> 2\n")
    code, out, _ = run("diff", "--git", "m.osim", old, "0" * 40, "100644", new, "1" * 40, "100644")
    assert code == 0 and out.startswith("--- m.osim\n+++ m.osim\n") and "mass: 1 -> 2" in out


def test_info(fixtures: Path) -> None:
    code, out, _ = run("info", str(fixtures / "walker" / "DynamicWalkerModel.osim"))
    assert code == 0
    for words in ("DynamicWalkerModel", "6 kg", "40600", "RKnee_rz", "locked", "6 ContactSphere"):
        assert words in out
    assert max(map(len, out.splitlines())) <= 80


def test_errors_are_one_sentence(tmp_path: Path) -> None:
    code, out, error = run("info", "nowhere.osim", folder=tmp_path)
    assert (code, out) == (2, "")
    assert (
        error
        == "osimlite: nowhere.osim: cannot read the file: no such file (see docs/errors.md#files)\n"
    )
    for command in ("info", "validate", "format"):
        code, out, error = run(command, "steady-walker", folder=tmp_path)
        assert (code, out) == (
            2,
            "",
        ) and "'osimlite build steady-walker -o steady-walker.osim'" in error
        assert error.count("\n") == 1
    code, _, error = run("info", ".", folder=tmp_path)
    assert code == 2 and "this is a folder; name a model file in it" in error
    said = "osimlite: .: no OpenSim file in this folder: no .osim, .xml or .omoco (see docs/lint-in-ci.md)\n"
    assert run("format", ".", folder=tmp_path) == (2, "", said)
    (tmp_path / "empty.osim").touch()
    assert run("format", "empty.osim", folder=tmp_path)[0] == 2


def test_build_takes_data(fixtures: Path, tmp_path: Path) -> None:
    from osimlite.io.document.data import write_data

    model = osimlite.read(fixtures / "walker" / "DynamicWalkerModel.osim")
    write_data(model, tmp_path / "w.json")
    code, _, error = run("build", "w.json", "-o", "w.osim", folder=tmp_path)
    assert code == 0, error
    assert osimlite.read(tmp_path / "w.osim") == model
    code, _, error = run("build", "w.json", "-p", "a=1", folder=tmp_path)
    assert code == 2 and "has no parameters" in error
    assert run("build", "nowhere.yaml", folder=tmp_path)[0] == 2


def test_errors_in_the_users_own_code_have_their_place(tmp_path: Path) -> None:
    for text, words in {
        "import osimlite\ndef m():\n    return osimlite.Bdy(name='b')\n": "mine.py:3: AttributeError",
        "import osimlite\ndef m():\n    return osimlite.Body(mas=1.0)\n": "mine.py:3: Body has no property 'mas'",
        "import osimlite\ndef m(n):\n    return osimlite.Model(name=n)\n": "-p n=VALUE",
    }.items():
        (tmp_path / "mine.py").write_text(text)
        code, _, error = run("build", "mine.py", folder=tmp_path)
        assert code in (1, 2) and words in error


def test_build_writes_to_standard_output_and_through_links(tmp_path: Path) -> None:
    (tmp_path / "real.osim").write_text("before")
    (tmp_path / "link.osim").symlink_to("real.osim")
    assert run("build", "dynamic-walker", "-o", "link.osim", folder=tmp_path)[0] == 0
    assert (tmp_path / "link.osim").is_symlink()
    code, out, _ = run("build", "dynamic-walker", "-o", "-", folder=tmp_path)
    assert code == 0 and out == (tmp_path / "real.osim").read_text()
    assert not (tmp_path / "-").exists()


def test_folders_that_cannot_be_made_are_named(fixtures: Path, tmp_path: Path) -> None:
    (tmp_path / "afile").write_text("")
    model = str(fixtures / "walker" / "DynamicWalkerModel.osim")
    for words in (
        ("simulate", model, "--to", "0.01"),
        ("demo", "--no-pictures"),
        ("translate", model),
    ):
        for place in ("afile", "afile/sub"):
            code, _, error = run(*words, "-o", place, folder=tmp_path)
            assert code == 2 and "afile: cannot make" in error, (words, error)


def test_diff_of_what_cannot_be_read_is_no_difference(fixtures: Path, tmp_path: Path) -> None:
    (tmp_path / "empty.osim").write_text("")
    (tmp_path / "text.osim").write_text("hello\n")
    model = str(fixtures / "walker" / "DynamicWalkerModel.osim")
    assert run("diff", model, "empty.osim", folder=tmp_path)[0] == 2
    assert "no element in it" in run("info", "text.osim", folder=tmp_path)[2]
