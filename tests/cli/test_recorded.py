"""Tests of ``kinematics``, ``inverse-dynamics`` and other commands on recorded motions."""

from __future__ import annotations

from pathlib import Path

import pytest

from osimlite.io.tables.storage import read_sto, write_sto
from tests.cli.command import run

pytest.importorskip("numpy", reason="needs numpy (extra 'sim')")


def test_the_walker_in_a_recorded_motion(fixtures: Path, tmp_path: Path) -> None:
    walker = str(fixtures / "walker" / "DynamicWalkerModel.osim")
    times = [0.01 * k for k in range(20)]
    rows = [[0.1 * t, 30.0 * t * t, 2.0] for t in times]
    write_sto(
        tmp_path / "walk.mot",
        "walk",
        times,
        ("Pelvis_tx", "RKnee_rz", "emg"),
        rows,
        in_degrees=True,
    )
    done = run("kinematics", walker, "walk.mot", "-o", "out", folder=tmp_path)
    assert (done.code, done.err) == (0, "")
    assert "ignored columns (no coordinate, or a repeated one): emg" in done.out
    bodies = read_sto(tmp_path / "out" / "bodies.sto")
    assert bodies.in_degrees
    assert bodies["RightShank_Oz"] - bodies["RightThigh_Oz"] == pytest.approx(
        [row[1] for row in rows], abs=1e-9
    )
    done = run("inverse-dynamics", walker, "walk.mot", "-o", "out", folder=tmp_path)
    assert (done.code, done.err) == (0, "")
    forces = read_sto(tmp_path / "out" / "inverse_dynamics.sto")
    assert forces["Pelvis_ty_force"][0] == pytest.approx(5.0 * 9.80665, rel=0.2)
    done = run("kinematics", walker, "nothing.mot", folder=tmp_path)
    assert done.code == 2
    assert "nothing.mot: cannot read the file" in done.err


def test_files_that_are_no_motion_are_named_for_what_they_are(
    fixtures: Path, tmp_path: Path
) -> None:
    walker = str(fixtures / "walker" / "DynamicWalkerModel.osim")
    (tmp_path / "m.trc").write_text("PathFileType\t4\t(X/Y/Z)\tm.trc\nDataRate\n60\n")
    (tmp_path / "m.csv").write_text("time,knee\n0,0\n")
    for words, said in (
        (
            (walker, "m.trc"),
            "m.trc: these are markers over time (.trc), but a storage file is needed here (.sto, .mot)",
        ),
        ((walker, "m.csv"), "m.csv: this is not a storage file (.sto, .mot)"),
        ((walker, walker), "this is XML, not a storage file"),
    ):
        for command in ("kinematics", "inverse-dynamics"):
            done = run(command, *words, folder=tmp_path)
            assert done.code == 2 and said in done.err, done.err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.csv", "m.trc"]


def test_results_without_a_folder_go_into_one_named_after_the_model(
    fixtures: Path, tmp_path: Path
) -> None:
    walker = fixtures / "walker" / "DynamicWalkerModel.osim"
    write_sto(
        tmp_path / "still.mot", "still", [0.1 * k for k in range(8)], ("Pelvis_tx",), [[0.1]] * 8
    )
    for command in ("kinematics", "inverse-dynamics"):
        assert run(command, str(walker), "still.mot", folder=tmp_path).code == 0
    written = sorted(path.name for path in (tmp_path / "DynamicWalkerModel").iterdir())
    assert written == ["bodies.sto", "inverse_dynamics.sto", "markers.sto"]


def test_a_filter_takes_the_noise_away(fixtures: Path, tmp_path: Path) -> None:
    walker = str(fixtures / "walker" / "DynamicWalkerModel.osim")
    rows = [[0.1 + 0.001 * (-1) ** k] for k in range(60)]
    write_sto(tmp_path / "walk.mot", "walk", [k / 64 for k in range(60)], ("Pelvis_tx",), rows)
    for folder, more in (("plain", ()), ("smooth", ("--lowpass", "6"))):
        for command in ("kinematics", "inverse-dynamics"):
            done = run(command, walker, "walk.mot", *more, "-o", folder, folder=tmp_path)
            assert (done.code, done.err) == (0, "")
    plain, smooth = (
        read_sto(tmp_path / folder / "bodies.sto")["Pelvis_X"] for folder in ("plain", "smooth")
    )
    assert (
        abs(smooth[11:-10] - smooth[10:-11]).max() < 0.01 * abs(plain[11:-10] - plain[10:-11]).max()
    )
    plain, smooth = (
        read_sto(tmp_path / folder / "inverse_dynamics.sto")["Pelvis_tx_force"]
        for folder in ("plain", "smooth")
    )
    assert abs(smooth[10:-10]).max() < 0.1 * abs(plain[10:-10]).max()
    for given, said in (
        ("0", "a low-pass frequency must be a positive number of Hz, not 0"),
        ("nan", "a low-pass frequency must be a positive number of Hz, not nan"),
        ("1e-300", None),
        ("32", "32 Hz is too high for samples every 0.015625 s; use less than 32 Hz"),
        ("1e308", "is too high for samples every 0.015625 s"),
    ):
        done = run(
            "inverse-dynamics", walker, "walk.mot", "--lowpass", given, "-o", "odd", folder=tmp_path
        )
        assert done.code == 0 if said is None else (done.code == 2 and said in done.err), done.err


LOADS = """<OpenSimDocument Version="40600"><ExternalLoads name="loads"><objects><ExternalForce name="push">
<applied_to_body>{body}</applied_to_body><force_identifier>f_</force_identifier></ExternalForce></objects>
<datafile>push.sto</datafile></ExternalLoads></OpenSimDocument>
"""


def test_measured_forces(fixtures: Path, tmp_path: Path) -> None:
    walker = str(fixtures / "walker" / "DynamicWalkerModel.osim")
    times = [0.01 * k for k in range(20)]
    write_sto(tmp_path / "still.mot", "still", times, ("Pelvis_tx",), [[0.1] for _ in times])
    write_sto(
        tmp_path / "push.sto", "push", [0.0, 1.0], ("f_x", "f_y", "f_z"), [[0.0, 7.0, 0.0]] * 2
    )
    (tmp_path / "loads.xml").write_text(LOADS.format(body="Pelvis"))
    lifted = []
    for words in ((), ("--external-loads", "loads.xml")):
        done = run("inverse-dynamics", walker, "still.mot", "-o", "out", *words, folder=tmp_path)
        assert (done.code, done.err) == (0, "")
        lifted.append(read_sto(tmp_path / "out" / "inverse_dynamics.sto")["Pelvis_ty_force"])
    # The platform is tilted by 10 degrees, and cos(10°) = 0.984807753.
    assert lifted[0] - lifted[1] == pytest.approx(7.0 * 0.984807753, rel=1e-6)
    done = run(
        "simulate",
        walker,
        "--to",
        "0.01",
        "--set",
        "Pelvis_ty=1",
        "-o",
        "out",
        "--external-loads",
        "loads.xml",
        folder=tmp_path,
    )
    assert (done.code, done.err) == (0, "")
    assert read_sto(tmp_path / "out" / "forces.sto")["Pelvis_push_Fy"] == pytest.approx(7.0)
    # Without data at some times the loads are extrapolated, as in OpenSim.
    push_times, push = times[:11], [[0.0, 7.0, 0.0]] * 11
    write_sto(tmp_path / "push.sto", "push", push_times, ("f_x", "f_y", "f_z"), push)
    for until, is_warned in (("0.1", False), ("1", True)):
        done = run(
            "inverse-dynamics", walker, "still.mot", "-o", "out", "--external-loads", "loads.xml",
            "--until", until, folder=tmp_path,
        )  # fmt: skip
        warning = "the loads are measured from 0 to 0.1 s, but the motion lasts from 0 to 0.19 s"
        assert (warning in done.out) == is_warned
    (tmp_path / "loads.xml").write_text(LOADS.format(body="Pelvic"))
    for command in (("simulate", walker), ("inverse-dynamics", walker, "still.mot")):
        done = run(*command, "-o", "out", "--external-loads", "loads.xml", folder=tmp_path)
        assert done.code == 2
        assert "loads.xml: the applied_to_body of 'push' is 'Pelvic'" in done.err
        assert "did you mean 'Pelvis'?" in done.err
    done = run("inverse-dynamics", walker, "still.mot", "--wrapping", "straight", folder=tmp_path)
    assert done.code == 2 and "there is no wrapping 'straight'" in done.err


def test_markers_as_trc(fixtures: Path, tmp_path: Path) -> None:
    walker = fixtures / "walker" / "DynamicWalkerModel.osim"
    write_sto(tmp_path / "still.mot", "still", [0.0, 0.5], ("Pelvis_tx",), [[0.1], [0.2]])
    done = run("kinematics", str(walker), "still.mot", "-o", "out", "--trc", folder=tmp_path)
    assert (done.code, done.err) == (0, "")
    lines = (tmp_path / "out" / "markers.trc").read_text().splitlines()
    assert lines[0] == "PathFileType\t4\t(X/Y/Z)\tmarkers.trc"
    assert lines[2].split("\t")[:4] == ["2", "2", "2", "0"]
    assert "markers.trc" in done.out


def test_loads_without_a_document(fixtures: Path, tmp_path: Path) -> None:
    """Options of the command replace a document of external loads; --from and --until select a part of the motion."""
    walker = str(fixtures / "walker" / "DynamicWalkerModel.osim")
    times = [0.01 * k for k in range(20)]
    write_sto(tmp_path / "still.mot", "still", times, ("Pelvis_tx",), [[0.1] for _ in times])
    write_sto(
        tmp_path / "push.sto", "push", [0.0, 1.0], ("f_x", "f_y", "f_z"), [[0.0, 7.0, 0.0]] * 2
    )
    (tmp_path / "loads.xml").write_text(LOADS.format(body="Pelvis"))
    lifted = []
    for words in (("loads.xml",), ("push.sto", "--applied-to", "Pelvis=f_")):
        done = run(
            "inverse-dynamics", walker, "still.mot", "--from", "0.05", "--until", "0.1", "-o", "out",
            "--external-loads", *words, folder=tmp_path,
        )  # fmt: skip
        assert (done.code, done.err) == (0, "")
        lifted.append((tmp_path / "out" / "inverse_dynamics.sto").read_text())
    assert lifted[0] == lifted[1]
    assert read_sto(tmp_path / "out" / "inverse_dynamics.sto").times == pytest.approx(times[5:11])
    wrong: list[tuple[tuple[str, ...], str]] = [
        (
            ("--external-loads", "push.sto"),
            "push.sto: this table does not name the bodies on which its forces act",
        ),
        (("--applied-to", "Pelvis=f_"), "pass the table as `external_loads`"),
        (("--external-loads", "push.sto", "--applied-to", "Pelvic=f_"), "did you mean 'Pelvis'?"),
        (
            ("--external-loads", "push.sto", "--applied-to", "Pelvis=g_"),
            "no column label of 'push.sto' begins with this text",
        ),
        (
            ("--external-loads", "push.sto", "--applied-to", "Pelvis"),
            "--applied-to takes BODY=FORCE,POINT,MOMENT",
        ),
        (("--from", "3"), "the motion has no row after 3 s"),
    ]
    for more, said in wrong:
        done = run("inverse-dynamics", walker, "still.mot", *more, folder=tmp_path)
        assert done.code == 2 and said in done.err, done.err
    done = run(
        "kinematics",
        walker,
        "still.mot",
        "--from",
        "0.05",
        "--until",
        "0.1",
        "-o",
        "out",
        folder=tmp_path,
    )
    assert done.code == 0 and "6 rows from 0.05 s to 0.1 s" in done.out


def test_forces_are_shared(fixtures: Path, tmp_path: Path) -> None:
    import osimlite

    model = osimlite.read(fixtures / "walker" / "DynamicWalkerModel.osim")
    names = [item.name for item in model.components(osimlite.Coordinate)]
    reserves = osimlite.ForceSet(name="reserves")
    for name in names:
        reserves.objects.append(
            osimlite.CoordinateActuator(name=f"{name}_reserve", coordinate=name)
        )
    osimlite.write(reserves, tmp_path / "reserves.xml")
    walker, times = (
        str(fixtures / "walker" / "DynamicWalkerModel.osim"),
        [0.02 * k for k in range(10)],
    )
    write_sto(tmp_path / "still.mot", "still", times, ("Pelvis_tx",), [[0.1]] * 10)
    done = run(
        "static-optimization",
        walker,
        "still.mot",
        "--forces",
        "reserves.xml",
        "-o",
        "out",
        folder=tmp_path,
    )
    assert (done.code, done.err) == (0, "")
    written = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert written == [
        f"StaticOptimization_{end}" for end in ("activation.sto", "controls.xml", "force.sto")
    ]
    activations = read_sto(tmp_path / "out" / written[0])
    run("inverse-dynamics", walker, "still.mot", "-o", "out", folder=tmp_path)
    moments = read_sto(tmp_path / "out" / "inverse_dynamics.sto")
    assert activations["Pelvis_ty_reserve"] == pytest.approx(moments["Pelvis_ty_force"], rel=1e-9)
    for item in reserves.objects:
        if item.name == "Pelvis_ty_reserve":
            item.min_control, item.max_control = 1000.0, 2000.0
    osimlite.write(reserves, tmp_path / "reserves.xml")
    done = run(
        "static-optimization",
        walker,
        "still.mot",
        "--forces",
        "reserves.xml",
        "-o",
        "out",
        folder=tmp_path,
    )
    assert (
        done.code == 1
        and "no solution at 10 of 10 times" in done.err
        and "at Pelvis_ty" in done.err
    )
    done = run("static-optimization", walker, "still.mot", folder=tmp_path)
    assert done.code == 1 and "no actuators" in done.err


def test_angles_that_look_like_degrees_are_reported(fixtures: Path, tmp_path: Path) -> None:
    walker = str(fixtures / "walker" / "DynamicWalkerModel.osim")
    header = "m\nversion=1\nnRows=7\nnColumns=2\ninDegrees={}\nendheader\ntime\tRHip_rz\n"
    rows = "".join(f"{0.1 * k:g}\t{60 + k}\n" for k in range(7))
    for stated, reported in (("no", True), ("yes", False)):
        (tmp_path / "m.mot").write_text(header.format(stated) + rows)
        done = run("inverse-dynamics", walker, "m.mot", "-o", stated, folder=tmp_path)
        assert done.code == 0, done.err
        assert ("the largest angle is 66 rad; if the motion is in degrees" in done.out) == reported
