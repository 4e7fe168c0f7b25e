"""Tests of many setups in one command: order, workers, failures, interruption and resumption."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import osimlite
from osimlite.errors import OsimliteError
from osimlite.tools.many import JOURNAL, compute_digest, find_setups, run_many
from osimlite.tools.running import list_runnable
from tests.cli.command import run
from tests.fitting.support import free_body
from tests.scripts import ROOT
from tests.tools.support import make_trial


@pytest.fixture
def trials(tmp_path: Path) -> Path:
    """Write a model and three trials, and return the folder."""
    osimlite.write(free_body(), tmp_path / "model.osim")
    for seed in range(3):
        make_trial(tmp_path / f"trial{seed}", seed)
    return tmp_path


def results(folder: Path) -> dict[str, bytes]:
    """Return the contents of all result files in a folder, by path."""
    files = [path for path in sorted(folder.rglob("*")) if path.suffix in (".mot", ".sto")]
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def clear(folder: Path) -> None:
    for name in results(folder):
        (folder / name).unlink()


def test_each_waits_for_what_it_needs_and_workers_change_no_byte(trials: Path) -> None:
    done = run("run", "trial*/id.xml", "trial*/z_ik.xml", folder=trials)
    assert done.code == 0 and done.out.endswith("6 setups: 6 done\n")
    alone = results(trials)
    assert len(alone) == 9 and not (trials / JOURNAL).exists()
    clear(trials)
    done = run("run", "trial*/id.xml", "trial*/z_ik.xml", "--workers", 2, "--json", folder=trials)
    assert done.code == 0 and results(trials) == alone
    told = json.loads(done.out)
    assert [item["setup"] for item in told][:2] == ["trial0/id.xml", "trial1/id.xml"]
    assert {item["status"] for item in told} == {"done"} and told[3]["summary"][
        "rms_marker_error"
    ] < 1e-8


@pytest.mark.full
def test_a_failure_stops_only_what_needs_it_and_is_mended_by_resuming(trials: Path) -> None:
    file = trials / "trial1" / "trial.trc"
    whole = file.read_text()
    file.write_text(
        whole.replace("one", "eno").replace("two", "owt").replace("three", "x").replace("four", "y")
    )
    done = run("run", "trial*/*.xml", folder=trials)
    assert done.code == 2 and "6 setups: 4 done, 1 failed, 1 not run" in done.out
    assert "needs results of trial1/z_ik.xml, which failed" in " ".join(done.out.split())
    assert (trials / JOURNAL).exists()
    file.write_text(whole)
    # With --resume, setups run again only if their inputs or results have changed.
    times = {name: (trials / name).stat().st_mtime_ns for name in results(trials)}
    (trials / "trial0" / "id.sto").unlink()
    done = run("run", "trial*/*.xml", "--resume", folder=trials)
    assert done.code == 0 and done.out.count("before") == 3 and not (trials / JOURNAL).exists()
    kept = {name for name, before in times.items() if (trials / name).stat().st_mtime_ns == before}
    assert kept == times.keys() - {"trial0/id.sto"}


def test_warnings_of_each_are_told_in_the_table(trials: Path) -> None:
    """The trials have a misspelt marker, and units that cannot be right."""
    one, two = trials / "trial0" / "trial.trc", trials / "trial1" / "trial.trc"
    one.write_text(one.read_text().replace("three", "thre"))
    setup = trials / "trial0" / "z_ik.xml"
    task = "<IKMarkerTask name='three'><apply>true</apply><weight>1</weight></IKMarkerTask>"
    tasks = f"<IKTaskSet><objects>{task.replace('three', 'one')}{task}</objects></IKTaskSet>"
    setup.write_text(setup.read_text().replace("</model_file>", f"</model_file>{tasks}"))
    lines = two.read_text().splitlines()
    lines[2] = lines[2].replace("\tm\t", "\tmm\t")
    two.write_text("\n".join(lines) + "\n")
    done = run("run", "trial*/z_ik.xml", folder=trials)
    said = " ".join(done.out.split())
    assert done.code == 0 and "3 setups: 3 done, 2 with warnings" in said
    assert "has no marker 'three'" in said and "(did you mean 'thre'?)" in said
    noted = json.loads(run("run", "trial*/z_ik.xml", "--json", folder=trials).out)
    assert [bool(item["warnings"]) for item in noted] == [True, True, False]
    assert noted[0]["warnings"][0].startswith("trial0/z_ik.xml:")
    alone = run("run", "trial1/z_ik.xml", folder=trials)
    assert "trial1/trial.trc:3:" in alone.err and "Found 1 warning in 1 file." in alone.err


def test_what_another_program_made_is_taken(trials: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A setup that cannot run here does not block others, because its results exist already."""
    monkeypatch.chdir(trials)
    monkeypatch.setattr(
        "osimlite.tools.many.list_runnable",
        lambda: [tag for tag in list_runnable() if tag != "RRATool"],
    )
    osimlite.run(trials / "trial0" / "z_ik.xml")
    other = osimlite.RRATool(
        name="rra", output_model_file="../model.osim", model_file="../first.osim"
    )
    osimlite.write(other, trials / "trial0" / "rra.xml")
    refused, done = run_many([trials / "trial0" / "rra.xml", trials / "trial0" / "id.xml"])
    assert (refused.status, done.status) == ("failed", "done")


def test_what_is_read_makes_the_digest(trials: Path) -> None:
    setup = trials / "trial0" / "z_ik.xml"
    before = compute_digest(setup)
    (trials / "model.osim").write_text(
        (trials / "model.osim").read_text().replace('"one"', '"other"', 1)
    )
    changed = compute_digest(setup)
    (trials / "trial0" / "trial.trc").unlink()
    assert len({before, changed, compute_digest(setup)}) == 3


def test_a_folder_for_all_has_one_for_each(trials: Path) -> None:
    made = run_many(find_setups([f"{trials}/trial*/z_ik.xml"]), trials / "out")
    assert [trial.status for trial in made] == ["done"] * 3
    assert sorted(results(trials / "out")) == [
        f"trial{k}/z_ik/{name}" for k in range(3) for name in ("ik.mot", "ik_ik_marker_errors.sto")
    ]


def test_two_that_write_one_file_are_told(trials: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(trials)
    setup = trials / "trial0" / "z_ik.xml"
    (trials / "trial0" / "again.xml").write_bytes(setup.read_bytes())
    one, two = run_many([setup, setup.with_name("again.xml")])
    for trial, other in ((one, two), (two, one)):
        assert (
            trial.status == "failed"
            and f"'{other.setup}' writes" in trial.failure
            and "-o FOLDER" in trial.failure
        )


def test_names_and_patterns(trials: Path) -> None:
    words: list[str | Path] = [trials / "trial1" / "id.xml", f"{trials}/**/id.xml"]
    assert find_setups(words) == [trials / f"trial{k}" / "id.xml" for k in (1, 0, 2)]
    osimlite.write(osimlite.ExternalLoads(name="loads"), trials / "trial0" / "grf.xml")
    osimlite.write(osimlite.IKTaskSet(name="tasks"), trials / "trial0" / "tasks.xml")
    (trials / "trial0" / "broken.xml").write_text("<OpenSimDocument")
    names = [
        path.name for path in find_setups([f"{trials}/**/*"]) if path.suffix in (".xml", ".osim")
    ]
    assert sorted(names) == ["broken.xml", *["id.xml"] * 3, *["z_ik.xml"] * 3], (
        "models and sets are no setups"
    )
    assert find_setups([trials / "model.osim"]) == [trials / "model.osim"], "what is named is meant"
    with pytest.raises(OsimliteError, match=r"the files that match '.*/grf\*\.xml' are models"):
        find_setups([f"{trials}/trial0/grf*.xml"])
    (trials / "trial0" / "walk.trc").write_text("PathFileType\n")
    with pytest.raises(OsimliteError, match="are models, sets and tables"):
        find_setups([f"{trials}/trial0/walk.t*"])
    with pytest.raises(OsimliteError, match=r"no file matches 'nothing\*\.xml'"):
        find_setups(["nothing*.xml"])


def started(folder: Path, *words: str) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "80"}
    return subprocess.Popen(
        [sys.executable, "-m", "osimlite", "run", *words],
        cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip


def await_results(folder: Path, least: int, process: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + 60.0
    while len(results(folder)) < least and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    assert len(results(folder)) >= least


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("how", ["keyboard", "all killed", "worker killed"])
@pytest.mark.full
def test_what_is_there_is_whole_and_resuming_ends_with_the_same_bytes(
    trials: Path, how: str
) -> None:
    for seed in range(3, 12):
        make_trial(trials / f"trial{seed}", seed, 400)
    run_many(find_setups([f"{trials}/trial*/*.xml"]))
    whole = results(trials)
    clear(trials)
    process = started(trials, "trial*/*.xml", "--workers", "2")
    await_results(trials, 4, process)
    if how == "worker killed":
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        if not children.exists():
            process.kill()
            pytest.skip("no list of processes")
        workers = [
            pid
            for pid in children.read_text().split()
            if "spawn_main" in Path(f"/proc/{pid}/cmdline").read_text()
        ]
        os.kill(int(workers[0]), signal.SIGKILL)
        out, err = process.communicate(timeout=100)
        assert process.returncode == 0 and "Traceback" not in err and "24 done" in out
    else:
        os.killpg(process.pid, signal.SIGINT if how == "keyboard" else signal.SIGKILL)
        _, err = process.communicate(timeout=100)
        assert (
            process.returncode == (130 if how == "keyboard" else -signal.SIGKILL)
            and "Traceback" not in err
        )
        assert how != "keyboard" or ("interrupted after" in err and "continue with --resume" in err)
        there = results(trials)
        assert there.items() <= whole.items()
        done = run("run", "trial*/*.xml", "--resume", folder=trials)
        assert done.code == 0
    assert results(trials) == whole
    # A killed process leaves temporary files next to its results.
    assert how != "keyboard" or not list(trials.rglob(".osimlite-*"))


@pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")
def test_a_full_disk_is_told_and_leaves_no_part(trials: Path) -> None:
    import resource

    limit = 3000

    def full() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    done = subprocess.run(
        [sys.executable, "-m", "osimlite", "run", "trial0/z_ik.xml"],
        cwd=trials, env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}, preexec_fn=full,
        capture_output=True, text=True, check=False, timeout=100,
    )  # fmt: skip
    assert (
        done.returncode == 2
        and "cannot write the file" in done.stderr
        and "Traceback" not in done.stderr
    )
    assert not list((trials / "trial0").glob(".osimlite*"))
    for name, content in results(trials).items():
        assert content.endswith(b"\n") and len(content) <= limit, name
