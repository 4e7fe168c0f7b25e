"""Tests of ``simulate`` on the command line."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import osimlite
from osimlite.errors import OsimliteError
from osimlite.models.jumper import jumper
from osimlite.schema.actuators import CoordinateActuator
from osimlite.simulation import read_sto, write_sto
from osimlite.simulation.engines import engine_name
from tests.bare import BareEnvironment
from tests.cli.command import run
from tests.simple_models import make_slide
from tests.simulation.damped import damped


@pytest.fixture
def walker(fixtures: Path) -> str:
    return str(fixtures / "walker" / "DynamicWalkerModel.osim")


def test_files_and_table(walker, tmp_path):
    start = "--set", "RHip_rz=40deg", "--set-speed", "LKnee_rz=-1.5"
    code, out, err = run("simulate", walker, "--to", "0.5", *start, "-o", "r", folder=tmp_path)
    assert (code, err) == (0, "")
    assert sorted(path.name for path in (tmp_path / "r").iterdir()) == [
        "forces.sto",
        "states.sto",
        "summary.json",
    ]
    states = read_sto(tmp_path / "r" / "states.sto")
    assert states["/jointset/RightThighToPelvis/RHip_rz/value"][0] == pytest.approx(
        0.6981317007977318
    )
    assert states["/jointset/LeftShankToThigh/LKnee_rz/speed"][0] == -1.5
    assert states.times[-1] == 0.5 and len(states.times) == 51
    assert max(map(len, out.splitlines())) <= 80 and "RFootForce" in out
    assert json.loads((tmp_path / "r" / "summary.json").read_text())["settings"][
        "initial_speeds"
    ] == {"LKnee_rz": -1.5}


@pytest.fixture
def stiff(tmp_path: Path) -> Path:
    """Write a model of a bob between stiff stops, against which it oscillates some 10,000 times per second."""
    stops = {
        "lower_limit": -0.01,
        "upper_limit": 0.0,
        "lower_stiffness": 1e10,
        "upper_stiffness": 1e10,
    }
    limit = osimlite.CoordinateLimitForce(
        name="stop", coordinate="x", damping=0.0, transition=1e-3, **stops
    )
    osimlite.write(make_slide(limit, default_value=1.0), tmp_path / "stiff.osim")
    return tmp_path / "stiff.osim"


@pytest.mark.parametrize("engine", ["bullet", "compiled"])
@pytest.mark.parametrize("choice", [("--accuracy", "1e-9"), ("--fixed-step", "1e-8")])
def test_a_long_run_tells_how_far_it_is_and_keeps_what_it_has_after_ctrl_c(stiff, engine, choice):
    pty = pytest.importorskip("pty", reason="needs terminals as POSIX has them")
    ours, theirs = pty.openpty()
    words = [
        "simulate",
        stiff.name,
        "--engine",
        engine,
        *choice,
        "--to",
        "9",
        "--report-interval",
        "9",
        "--plot",
    ]
    command = [sys.executable, "-m", "osimlite", *words]
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "160"}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=theirs, text=True, cwd=stiff.parent, env=environment
    ) as process:
        said, is_sent = "", False
        while process.poll() is None or select.select([ours], [], [], 0.0)[0]:
            if select.select([ours], [], [], 0.1)[0]:
                said += os.read(ours, 10_000).decode()
            if "s), steps of " in said and not is_sent:
                process.send_signal(signal.SIGINT)
                is_sent = True
        out = process.stdout.read()
    assert process.returncode == 130, said
    assert (
        "simulating" in said
        and "s), steps of " in said
        and "interrupted at" in said
        and "Traceback" not in said
    )
    assert "steps" in out
    folder = stiff.parent / "stiff"
    assert sorted(path.name for path in folder.iterdir()) == [
        "forces.sto",
        "states.sto",
        "summary.json",
    ]
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["interrupted"] is True and 0.0 < summary["time_reached_s"] < 9.0
    for name in ("states.sto", "forces.sto"):
        assert read_sto(folder / name).times.tolist() == [0.0, summary["time_reached_s"]]


def test_fixed_step(walker, tmp_path):
    code, out, _ = run(
        "simulate",
        walker,
        "--to",
        "0.1",
        "--fixed-step",
        "1e-3",
        "--report-interval",
        "0.05",
        folder=tmp_path,
    )
    assert code == 0 and "100 accepted, 0 rejected" in out
    # The default output folder has the name of the model file.
    assert len(read_sto(tmp_path / "DynamicWalkerModel" / "states.sto").times) == 3
    assert [path.name for path in tmp_path.iterdir()] == ["DynamicWalkerModel"]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["--set", "RHip=1"], 2, "did you mean 'RHip_rz'"),
        (["--set", "RHip_rz"], 2, "COORDINATE=VALUE"),
        (["--set", "RHip_rz=fast"], 2, "a number such as 0.5 or 30deg"),
        (["--set", "Pelvis_tx=3deg"], 2, "m, cm or mm"),
        (["--set", "RHip_rz=3cm"], 2, "deg or rad"),
        (["--set", "platform_rz=0"], 2, "is locked"),
        (["--set-speed", "platform_rz=0"], 2, "is locked"),
        (["--to", "-1"], 2, "must be positive"),
        (["--set-speed", "Pelvis_tx=3deg"], 2, "m/s, cm/s or mm/s"),
        (
            ["--fixed-step", "0.1", "--accuracy", "1e-3"],
            2,
            "--accuracy cannot be combined with --fixed-step",
        ),
        (["--set", "RHip_rz=0.1", "--set", "RHip_rz=0.2"], 2, "--set names 'RHip_rz' twice"),
        (["--engine", "bulet"], 2, "did you mean 'bullet'"),
        (["--gui"], 1, "no screen"),
    ],
)
def test_failure_says_one_sentence_and_leaves_nothing(walker, tmp_path, arguments, code, words):
    if "--gui" in arguments:
        pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
    result, out, err = run("simulate", walker, *arguments, "-o", "r", folder=tmp_path)
    assert result == code and out == ""
    assert len(err.splitlines()) == 1 and words in err
    assert list(tmp_path.iterdir()) == []


def test_failure_on_the_way_keeps_what_was_recorded(walker, tmp_path):
    code, out, err = run("simulate", walker, "--fixed-step", "0.1", "-o", "r", folder=tmp_path)
    kept, said = err.splitlines()
    assert (
        code == 1
        and "stopped at" in kept
        and "motion up to there is saved in 'r'" in kept
        and "shorter fixed step" in said
    )
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    assert read_sto(tmp_path / "r" / "states.sto").times[-1] == summary["time_reached_s"] > 0.0
    assert "steps" in out


def test_contacts_without_stiffness_are_named(walker, tmp_path):
    """OpenSim computes NaN for such contacts. osimlite leaves out their force and must report it."""
    text = (
        Path(walker)
        .read_text()
        .replace("stiffness>1000000</stiffness", "stiffnes>1000000</stiffnes", 1)
    )
    assert "stiffnes>" in text
    (tmp_path / "m.osim").write_text(text)
    done = run("simulate", "m.osim", "--to", "0.1", "-o", "r", folder=tmp_path)
    assert done.code == 0 and "contacts with a stiffness of 0 exert no force here" in " ".join(
        done.out.split()
    )
    done = run("simulate", walker, "--to", "0.1", "-o", "s", folder=tmp_path)
    assert done.code == 0 and "stiffness" not in done.out


@pytest.mark.parametrize(
    ("options", "depth"),
    [((), None), (("--set", "Pelvis_ty=0.8"), "56.6 mm"), (("--set", "Pelvis_ty=1.7"), None)],
)
def test_a_contact_whose_centre_starts_inside_the_floor_is_named(walker, tmp_path, options, depth):
    """The pose of the simulation counts, not the default pose that the rule checks."""
    code, _, err = run(*("simulate", walker, "--to", "0.002", *options, "-o", "r"), folder=tmp_path)
    assert code == 0
    if depth is None:
        assert err == ""
    else:
        (line,) = err.splitlines()
        assert line.startswith("osimlite: warning: sphere 'RFootContact' starts " + depth)
        assert "OSIM521" in line and f"'osimlite validate {walker}'" in line


def test_unsupported_force(walker, tmp_path):
    text = Path(walker).read_text()
    station = "<Station><socket_parent_frame>/ground</socket_parent_frame></Station>"
    sole = f'<ExponentialContactForce name="sole">{station}</ExponentialContactForce>'
    place = text.index("<objects>", text.index("<ForceSet")) + len("<objects>")
    (tmp_path / "m.osim").write_text(text[:place] + sole + text[place:])
    code, _, err = run("simulate", "m.osim", folder=tmp_path)
    assert code == 1 and "/forceset/sole" in err and "--skip-unsupported" in err
    code, out, _ = run("simulate", "m.osim", "--skip-unsupported", "--to", "0.1", folder=tmp_path)
    assert code == 0 and "left out" in out


def test_pictures_fail_as_a_whole(walker, tmp_path, monkeypatch):
    from osimlite.cli import simulate as command
    from osimlite.view import plots

    def fail(*_: object) -> list[Path]:
        raise OsimliteError("no ink")

    pytest.importorskip("matplotlib", reason="needs matplotlib (extra 'plot')")
    monkeypatch.setattr(plots, "plot_simulation", fail)
    with pytest.raises(OsimliteError, match="no ink"):
        command.simulate(Path(walker), to=0.05, output=tmp_path / "r", plot=True)
    assert not (tmp_path / "r").exists()


def test_degrees_taken_for_radians_are_refused(walker, tmp_path):
    for command in ("simulate", "gait", "view"):
        code, _, err = run(command, walker, "--set", "RHip_rz=40", folder=tmp_path)
        assert code == 2 and err.startswith(
            "osimlite: --set: RHip_rz = 40 is in rad, and outside its range of -1.75 to 1.75 rad; did you mean 40deg? "
            "(if not, write 40rad) (see docs/"
        )
    assert not list(tmp_path.iterdir())
    for value in ("40deg", "500deg", "40rad", "2"):
        words = ("--set", f"RHip_rz={value}", "--set-speed", "RHip_rz=7")
        code, _, err = run("simulate", walker, "--to", "0.01", *words, folder=tmp_path)
        assert (code, err) == (0, "")


def test_a_motion_goes_on_from_a_file_of_states(tmp_path):
    """All states start from the last row of the file; --set overrides single states."""
    osimlite.write(damped(), tmp_path / "damped.osim")
    words = ["simulate", str(tmp_path / "damped.osim"), "--to", "0.05"]
    spent = "/forceset/stop/dissipatedEnergy"
    run(*words, "--set", f"{spent}=0.5", "-o", str(tmp_path / "spent"))
    assert read_sto(tmp_path / "spent" / "states.sto")[spent][0] == 0.5
    for name, value, told in (
        (spent, "much", f"the state '{spent}' takes a number, not 'much'"),
        (spent[:-1], "1", f"has no coordinate or state '{spent[:-1]}'; did you mean '{spent}'?"),
    ):
        done = run(*words, "--set", f"{name}={value}", folder=tmp_path)
        assert done.code == 2 and told in done.err
    run(*words, "-o", str(tmp_path / "one"))
    run(
        *words,
        "--states",
        str(tmp_path / "one" / "states.sto"),
        "--set",
        "q1=0.25",
        "-o",
        str(tmp_path / "two"),
    )
    one, two = (read_sto(tmp_path / folder / "states.sto") for folder in ("one", "two"))
    changed = one.columns.index("/jointset/j1/q1/value")
    assert two.rows[0, changed] == 0.25 and one.columns == two.columns
    same = [index for index in range(len(one.columns)) if index != changed]
    assert two.rows[0, same].tolist() == one.rows[-1, same].tolist()


def test_what_a_motion_goes_on_from_is_not_replaced(tmp_path):
    osimlite.write(damped(), tmp_path / "damped.osim")
    assert run("simulate", "damped.osim", "--to", "0.05", folder=tmp_path).code == 0
    before = (tmp_path / "damped" / "states.sto").read_bytes()
    again = "simulate", "damped.osim", "--to", "0.1", "--resume", "damped"
    for words in ((), ("-o", tmp_path / "damped")):
        done = run(*again, *words, folder=tmp_path)
        assert (
            done.code == 2 and "has the earlier simulation; name another folder with -o" in done.err
        )
    assert (tmp_path / "damped" / "states.sto").read_bytes() == before
    assert run(*again, "-o", "second", folder=tmp_path).code == 0


@pytest.fixture(scope="module")
def without_pybullet(tmp_path_factory: pytest.TempPathFactory) -> BareEnvironment:
    """Return an environment with the extra `sim` alone, in which PyBullet is not installed."""
    return BareEnvironment(tmp_path_factory.mktemp("sim") / "environment", ("sim",))


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ((), 0, "compiled"),
        (("--engine", "auto", "--fixed-step", "1e-3"), 0, "engine 'auto' is deprecated"),
        (("--engine", "bullet"), 2, "pip install 'osimlite[bullet]'"),
        (("--gui",), 2, "pip install 'osimlite[bullet]'"),
        (("--engine", "compiled", "--gui"), 1, "the compiled engine shows no window"),
    ],
)
def test_results_do_not_depend_on_pybullet(without_pybullet, walker, tmp_path, words, code, said):
    """The compiled engine is the default, whether or not PyBullet is installed; only options select PyBullet."""
    arguments = "simulate", walker, "--to", "0.1", *words
    done = without_pybullet.call(*arguments, "-o", "without", folder=tmp_path)
    assert done.returncode == code, done.stderr
    assert said in done.stdout + done.stderr
    if code == 0:
        assert (
            json.loads((tmp_path / "without" / "summary.json").read_text())["engine"] == "compiled"
        )
        assert run(*arguments, "-o", "here", folder=tmp_path).code == 0
        states = [(tmp_path / folder / "states.sto").read_bytes() for folder in ("without", "here")]
        assert states[0] == states[1]


def test_auto_is_a_deprecated_name_of_the_default():
    assert engine_name() == "compiled"
    with pytest.warns(DeprecationWarning, match="leave it out, or select 'bullet'"):
        assert engine_name("auto") == "compiled"


def test_muscles_that_start_in_equilibrium_are_not_called_otherwise(tmp_path):
    osimlite.write(jumper(), tmp_path / "jumper.osim")
    words = "simulate", "jumper.osim", "--to", "0.001", "-o", "r"
    out = " ".join(run(*words, folder=tmp_path).out.split())
    assert "muscles start with the fiber lengths in the file; if these are not" in out
    assert "note " in out and "warning" not in out
    assert "in equilibrium" not in run(*words, "--equilibrate", folder=tmp_path).out


@pytest.fixture
def driven(tmp_path: Path) -> Path:
    """Write a model of a bob on a rail with two motors, and a table of controls for one of them."""
    model = make_slide(*(CoordinateActuator(name=name, coordinate="x") for name in "ab"))
    osimlite.write(model, tmp_path / "driven.osim")
    write_sto(tmp_path / "controls.sto", "controls", [0.0, 0.2], ["/forceset/a"], [[1.0], [3.0]])
    return tmp_path / "driven.osim"


def test_controls_of_a_table_and_of_a_number(driven):
    words = "--controls", "controls.sto", "--controls", "b=-2.5"
    code, _, err = run("simulate", driven.name, "--to", "0.2", *words, folder=driven.parent)
    assert (code, err) == (0, "")
    forces = read_sto(driven.parent / "driven" / "forces.sto")
    assert forces["a"].tolist() == pytest.approx((1.0 + 10.0 * forces.times).tolist(), abs=1e-12)
    assert (forces["b"] == -2.5).all()
    summary = json.loads((driven.parent / "driven" / "summary.json").read_text())
    assert summary["settings"]["controls"] == {"/forceset/a": "a table", "b": -2.5}


def test_what_is_doubtful_is_told_and_done(driven):
    code, _, err = run(
        "simulate", driven.name, "--to", "0.5", "--controls", "controls.sto", folder=driven.parent
    )
    told = (
        "osimlite: the controls cover only 0 to 0.2 s of the motion, which goes from 0 to 0.5 s; "
    )
    assert (code, err) == (0, told + "outside, the first and last values are used\n")
    assert read_sto(driven.parent / "driven" / "forces.sto")["a"][-1] == 3.0


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("c=1",), "the model has no actuator 'c' to control"),
        (("b",), "--controls takes a file, or NAME=VALUE with a number; got 'b'"),
        (("b=fast",), "--controls takes a file, or NAME=VALUE with a number; got 'b=fast'"),
        (("b=1", "b=2"), "'b' is controlled twice; leave one out"),
        (
            ("controls.sto", "a=2"),
            "'/forceset/a' is controlled twice, by its name and by its path; leave one out",
        ),
        (("gone.sto",), "gone.sto: cannot read the file: no such file"),
        (("bad.sto",), "bad.sto:6:7: 'a' is nan; give a number"),
    ],
)
def test_controls_that_do_not_fit(driven, words, told):
    (driven.parent / "bad.sto").write_text("bad\nendheader\ntime\ta\n0\t1\n0.1\t2\n0.125\tnan\n")
    options = [part for word in words for part in ("--controls", word)]
    code, out, err = run("simulate", driven.name, *options, folder=driven.parent)
    assert (code, out) == (1 if words == ("bad.sto",) else 2, "")
    assert told in " ".join(err.split())
    assert not (driven.parent / "driven").exists()
