"""Tests of ``info``, ``diff`` and ``format`` on the command line."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import osimlite
from osimlite.errors import NotWellFormedError
from osimlite.io.document.reader import read
from osimlite.lint import validate
from tests.cli.command import run

WALKER = Path(__file__).resolve().parents[2] / "fixtures" / "walker" / "DynamicWalkerModel.osim"


def test_info_breaks_no_name_and_says_units():
    lines = run("info", WALKER).out.splitlines()
    assert "  RightThighToPelvis (PinJoint)" in lines
    assert "    RHip_rz        0.5236 rad  -1.745 to 1.745 rad" in lines
    assert "    Pelvis_tx           0 m    0 to 10 m" in lines
    assert "    platform_rz   -0.1745 rad  -1.745 to 1.745 rad  (locked)" in lines
    assert any("8 Coordinate," in line for line in lines) and max(map(len, lines)) <= 80


@pytest.mark.full
def test_info_says_of_a_changed_model_anew_whether_it_can_be_simulated(tmp_path, own_cache):
    file, text = tmp_path / "walker.osim", WALKER.read_text()

    def said() -> str:
        return next(
            line.split(None, 1)[1]
            for line in run("info", file).out.splitlines()
            if "simulation" in line
        )

    def answers() -> list[Path]:
        return list(own_cache.rglob("answers/*.json"))

    file.write_text(text)
    assert said() == "possible, every force is supported"
    (kept,) = answers()
    kept.write_text(kept.read_text().replace("possible", "known to be possible"))
    assert said() == "known to be possible, every force is supported"
    for damage in ("[", "{}", "[1, 2]", "[" * 100_000):
        kept.write_text(damage)
        assert said() == "possible, every force is supported"
    file.write_text(text.replace("CoordinateLimitForce", "CoordinateLimitForse"))
    assert said().startswith("possible only without unsupported forces")
    assert len(answers()) == 1
    # The cache of `info` does not cover included files: they are read every time.
    start, end = text.index("<ForceSet"), text.index("</ForceSet>") + len("</ForceSet>")
    forces = f'<OpenSimDocument Version="40500">{text[start:end]}</OpenSimDocument>'
    file.write_text(f'{text[:start]}<ForceSet file="forces.xml"/>{text[end:]}')
    (tmp_path / "forces.xml").write_text(forces)
    assert said() == "possible, every force is supported"
    (tmp_path / "forces.xml").write_text(
        forces.replace("CoordinateLimitForce", "CoordinateLimitForse")
    )
    assert said().startswith("possible only without unsupported forces")
    file.write_text(text.replace("<mass>", "<mass>nan "))
    assert said().startswith("not possible") and len(answers()) == 1 and "left out" not in said()


def test_info_of_a_setup_file_names_its_files(fixtures):
    rows = [
        line.split(None, 1)
        for line in run("info", fixtures / "documents" / "analyze.xml").out.splitlines()
    ]
    assert ["AnalyzeTool", "walk"] in [[word.strip() for word in row] for row in rows]
    files = [row[1].strip() for row in rows if row and row[0] == "force_set_files"]
    assert files == ["residuals.xml (missing)", "reserves.xml (missing)"]
    assert any("1 StaticOptimization" in row[-1] for row in rows if row)


def test_info_of_tables(fixtures):
    said = run("info", fixtures / "setups" / "coords.mot").out
    rows = dict(line.split("  ", 1) for line in said.splitlines() if "  " in line.strip())
    assert (rows["rows"].strip(), rows["time"].strip(), rows["inDegrees"].strip()) == (
        "61",
        "0 to 1 s, 60 Hz",
        "yes",
    )
    assert "Columns: pelvis_tilt, " in said and "--all" not in said
    said = run("info", fixtures / "setups" / "walk.trc", "--all").out
    assert "markers" in said and "mm" in said and "R.ASIS" in said and "--all" not in said
    assert max(map(len, said.splitlines())) <= 80


def test_diff_of_tables(fixtures, tmp_path):
    old, new = fixtures / "setups" / "coords.mot", tmp_path / "new.mot"
    head, _, rows = (
        old.read_text().replace("inDegrees=yes", "inDegrees=no").partition("pelvis_tilt")
    )
    first, *others = rows.splitlines(keepends=True)
    words = others[6].split("\t")
    words[2] = "1.5"
    new.write_text(
        f"{head}tilt{first}{''.join(others[:6])}" + "\t".join(words) + "".join(others[7:-1])
    )
    done = run("diff", old, new)
    assert done.code == 1 and done.out.splitlines()[:4] == [
        "- pelvis_tilt", "+ tilt", "  inDegrees: yes -> no", "  rows: 61 -> 60",
    ]  # fmt: skip
    assert done.out.splitlines()[5:] == [
        "  pelvis_tx: 0.62331989 -> 1.5 at 0.1 s, where the difference is largest; "
        "differs at 1 of the 60 times that both tables have"
    ]
    assert (run("diff", old, old).code, run("diff", old, old).out) == (0, "")
    told = run("diff", new, fixtures / "walker" / "DynamicWalkerModel.osim")
    assert told.code == 2 and "is a table and" in told.err and "XML" not in told.err
    said = run("format", old).err
    assert "no element in it; the commands 'validate' and 'info' accept tables" in said
    assert (
        run("diff", "--git", "a.mot", "/dev/null", "0", "0", old, "0", "0").out.splitlines()[2]
        == "+ pelvis_tilt"
    )


def test_format_and_diff_of_setup_files(fixtures, tmp_path):
    old = shutil.copy(fixtures / "documents" / "ik.xml", tmp_path / "old.xml")
    (tmp_path / "pom.xml").write_text("<project/>")
    assert run("format", "--check", tmp_path).code == 0
    new = tmp_path / "new.xml"
    new.write_text(Path(old).read_text().replace("<weight>10<", "<weight>20<"))
    result = run("diff", old, new)
    assert (result.code, result.out.splitlines()) == (
        1,
        ["  trial3", "    IKTaskSet.objects[r.knee].weight: 10 -> 20"],
    )


def test_info_lists_muscles_and_says_what_can_be_simulated(tmp_path):
    model = osimlite.Model(name="m")
    body = model.add(osimlite.Body(name="b", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    model.add(osimlite.SliderJoint(name="rail").between(model.ground, body))
    body.wrap_object_set.objects.append(osimlite.WrapSphere(name="ball", radius=0.1))
    for kind, wraps in ((osimlite.Thelen2003Muscle, 1), (osimlite.RigidTendonMuscle, 0)):
        muscle = model.add(kind(name=f"m{wraps}", max_isometric_force=546.0))
        path = muscle.geometry_path
        path.path_point_set.objects += [
            osimlite.PathPoint(
                name="o", socket_parent_frame=model.ground, location=(0.5, 0.0, 0.0)
            ),
            osimlite.PathPoint(name="i", socket_parent_frame=body, location=(0.0, 0.2, 0.0)),
        ]
        path.path_wrap_set.objects += [osimlite.PathWrap(name="w", wrap_object="ball")] * wraps
    osimlite.write(model, tmp_path / "m.osim")
    lines = run("info", tmp_path / "m.osim").out.splitlines()
    assert "    m1     546 N     0.1 m     0.2 m  2 points, 1 wrap" in lines
    assert "    m0     546 N     0.1 m     0.2 m  2 points" in lines
    facts = dict(line.split("  ", 1) for line in lines if "  " in line.strip())
    assert facts["wrap surfaces"].strip() == "1, used by 1 path wrap"
    assert facts["simulation"].strip() == "possible, every force is supported"
    assert facts["other forces"].strip() == "0"
    # Since OpenSim 4, forces may also be in <components>, outside the ForceSet.
    model.subcomponents.append(model.force_set.objects.pop())
    osimlite.write(model, tmp_path / "m.osim")
    facts = dict(
        line.split("  ", 1)
        for line in run("info", tmp_path / "m.osim").out.splitlines()
        if "  " in line.strip()
    )
    assert facts["muscles"].strip() == "2" and facts["other forces"].strip() == "0"
    model.force_set.objects.append(model.subcomponents.pop())
    model.find("/forceset/m1").ignore_tendon_compliance = True
    osimlite.write(model, tmp_path / "m.osim")
    assert "not possible: the ignore_tendon_compliance of '/forceset/m1'" in " ".join(
        run("info", tmp_path / "m.osim").out.split()
    )
    model.find("/forceset/m1").ignore_tendon_compliance = False
    body.mass, body.inertia = 0.0, (0.0,) * 6
    osimlite.write(model, tmp_path / "m.osim")
    done = run("info", tmp_path / "m.osim")
    assert done.err == "" and "moves no mass" in " ".join(done.out.split())


def test_format_says_when_there_is_nothing_to_do(tmp_path):
    path = tmp_path / "walker.osim"
    shutil.copy(WALKER, path)
    assert run("format", path).out == f"reformatted {path}\n"
    for option in ((), ("--check",), ("--diff",)):
        done = run("format", path, *option)
        assert (done.code, done.out, done.err) == (0, "", "1 file is formatted already\n")
    done = run("format", path, path)
    assert done.err == "1 file is formatted already\n"


@pytest.mark.parametrize(
    ("old", "new"),
    [("</Body>", "</Boddy>"), ("<mass>1</mass>", "<mass>1</mass"), ("<mass>", "<mass")],
)
def test_every_command_names_the_same_place_of_a_syntax_error(old, new, tmp_path):
    path = tmp_path / "broken.osim"
    path.write_text(WALKER.read_text().replace(old, new, 1))
    with pytest.raises(NotWellFormedError) as caught:
        read(path)
    finding = next(finding for finding in validate(path) if finding.code == "OSIM001")
    assert (finding.line, finding.column) == (caught.value.line, caught.value.column)
    assert f"{path}:{finding.line}:{finding.column}: not well-formed XML" in run("info", path).err
    assert "only tags and values above line" in finding.message


def test_components_are_counted_as_on_the_page():
    from osimlite.view.inspect import component_tree

    nodes, _ = component_tree(read(WALKER))
    said = next(
        line for line in run("info", WALKER).out.splitlines() if line.startswith("components ")
    )
    assert said.split()[1:] == [str(len(nodes)), "in", "the", "file"]
