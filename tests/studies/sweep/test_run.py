"""Tests of sweeps on this machine: the file is the same for any number of workers and after any interruption."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.errors import MissingFileError, OsimliteError, SettingError
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.studies.sweep import results
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.results import (
    PartialTable,
    compute_ranges,
    describe_differences,
    make_schema,
    settings_of,
)
from osimlite.studies.sweep.run import SweepInterruption, sweep
from osimlite.studies.sweep.sampling import choose_samples

pq = pytest.importorskip("pyarrow.parquet", reason="needs pyarrow (extra 'sweep')")
VARY = {"RHip_rz": (0.3, 0.7), "/forceset/*Foot*/contact_parameters/stiffness": (1e5, 1e6, "log")}


@pytest.fixture
def made(walker):
    return plan(walker, VARY, measures=("distance", "largest_force"), to=0.3)


def test_the_file_is_the_same_from_any_number_of_workers(made, tmp_path):
    chosen = choose_samples(made.variables, "sobol", 60, 5)
    outcomes = [
        sweep(made, chosen, tmp_path / f"{count}.parquet", workers=count) for count in (1, 2, 3)
    ]
    whole = outcomes[0].path.read_bytes()
    assert [outcome.path.read_bytes() == whole for outcome in outcomes] == [True] * 3
    table = pq.read_table(outcomes[0].path).to_pydict()
    assert table["run"] == list(range(60)) and table["status"] == ["done"] * 60
    rows = chosen.make_block(0, 60)
    assert table["RHip_rz"] == rows[:, 0].tolist()
    assert outcomes[0].status == {"done": 60}
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "1.parquet",
        "2.parquet",
        "3.parquet",
    ]


def test_results_are_tables_and_show_themselves(made, tmp_path):
    for package in ("pandas", "xarray"):
        pytest.importorskip(package, reason=f"needs {package} (extra 'frame')")
    outcome = sweep(made, choose_samples(made.variables, "sobol", 12, 5), tmp_path / "r.parquet")
    table, frame, data = outcome.to_arrow(), outcome.to_frame(), outcome.to_xarray()
    assert table.num_rows == 12 and frame.index.name == "run" and data.sizes == {"run": 12}
    assert (
        frame["distance"].tolist()
        == table["distance"].to_pylist()
        == data["distance"].values.tolist()
    )
    html = outcome._repr_html_()
    assert "12 runs" in html and "and 2 more" in html and f"{frame['distance'][0]:.6g}" in html
    outcome.path.write_bytes(b"PAR1")
    with pytest.raises(OsimliteError, match="damaged"):
        outcome.to_frame()


@pytest.mark.full
def test_processes_of_bullet_too(walker, tmp_path):
    pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
    made = plan(walker, {"RHip_rz": (0.3, 0.7)}, to=0.2, engine="bullet")
    chosen = choose_samples(made.variables, "random", 12, 1)
    whole = [
        sweep(made, chosen, tmp_path / f"{n}.parquet", workers=n).path.read_bytes() for n in (1, 2)
    ]
    assert whole[0] == whole[1]


def test_settings_are_in_the_file(made, tmp_path):
    chosen = choose_samples(made.variables, "lhs", 5, 3)
    result = settings_of(sweep(made, chosen, tmp_path / "r.parquet").path)
    assert result["sampler"] == "lhs" and result["samples"] == 5 and result["seed"] == 3
    assert result["vary"][0] == {"name": "RHip_rz", "low": 0.3, "high": 0.7}
    assert result["vary"][1]["log"] is True
    assert (
        result["engine"] == "compiled"
        and result["to"] == 0.3
        and result["measures"] == ["distance", "largest_force"]
    )


class Stopper:
    """Progress function that interrupts once `after` runs are done; with one worker the first runs are saved then."""

    def __init__(self, after):
        self.after = after

    def __call__(self, done, of):
        if done >= self.after:
            raise KeyboardInterrupt


def test_an_interrupted_sweep_goes_on(made, tmp_path):
    chosen = choose_samples(made.variables, "sobol", 80, 5)
    whole = sweep(made, chosen, tmp_path / "whole.parquet").path.read_bytes()
    path = tmp_path / "r.parquet"
    for after in (10, 40):
        with pytest.raises(SweepInterruption, match="--resume"):
            sweep(made, chosen, path, resume=after > 10, workers=1, progress=Stopper(after))
        assert not path.exists() and path.with_name("r.parquet.partial").exists()
    with pytest.raises(SettingError, match="continue with --resume"):
        sweep(made, chosen, path)
    counts = []
    outcome = sweep(made, chosen, path, resume=True, progress=lambda done, of: counts.append(done))
    assert path.read_bytes() == whole
    assert outcome.before >= 4 and outcome.before + sum(outcome.status.values()) == 80
    assert counts[0] == outcome.before and counts[-1] == 80 and counts == sorted(counts)
    again = sweep(made, chosen, path, resume=True)
    assert again.before == 80 and not again.status


def test_a_colon_in_the_name_of_a_file_is_no_protocol(made, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    chosen = choose_samples(made.variables, "sobol", 4, 5)
    assert sweep(made, chosen, "s3:r.parquet").count == 4
    assert settings_of("s3:r.parquet")["samples"] == 4 and compute_ranges(
        "s3:r.parquet", ["distance"]
    )
    assert sweep(made, chosen, "s3:r.parquet", resume=True).before == 4
    with pytest.raises(MissingFileError, match="no such file"):
        settings_of("s3:none.parquet")


def test_interrupted_before_anything_was_saved(made, tmp_path):
    with pytest.raises(SweepInterruption, match=r"^interrupted before any run was saved$"):
        sweep(
            made,
            choose_samples(made.variables, "sobol", 80, 5),
            tmp_path / "r.parquet",
            progress=Stopper(0),
        )
    assert not list(tmp_path.iterdir())


def test_other_settings_are_told_apart(made, walker, tmp_path):
    path = tmp_path / "r.parquet"
    chosen = choose_samples(made.variables, "sobol", 40, 5)
    with pytest.raises(SweepInterruption):
        sweep(made, chosen, path, workers=1, progress=Stopper(8))
    with pytest.raises(SettingError, match=r"seed \(5 before, 6 now\)"):
        sweep(made, choose_samples(made.variables, "sobol", 40, 6), path, resume=True)
    walker.tree().by_path["/bodyset/Pelvis"].mass = 2.0
    other = plan(walker, VARY, measures=("distance", "largest_force"), to=0.4)
    with pytest.raises(SettingError, match=r"other settings: model and to \(0.3 before, 0.4 now\)"):
        sweep(other, chosen, path, resume=True)
    with pytest.raises(
        SettingError, match=r"other settings: wrapping \(opensim before, geodesic now\)"
    ):
        sweep(replace(made, wrapping="geodesic"), chosen, path, resume=True)
    (tmp_path / "x.parquet.partial").write_text("something else")
    with pytest.raises(SettingError, match="is not an interrupted sweep"):
        sweep(made, chosen, tmp_path / "x.parquet", resume=True)
    sweep(made, chosen, path, resume=True)
    with pytest.raises(SettingError, match=r"samples \(40 before, 41 now\); name another output"):
        sweep(made, choose_samples(made.variables, "sobol", 41, 5), path, resume=True)


def test_finished_results_are_spared_unless_forced(made, tmp_path):
    path = tmp_path / "r.parquet"
    few, more = (choose_samples(made.variables, "sobol", count, 5) for count in (6, 8))
    first = sweep(made, few, path).path.read_bytes()
    for resume in (False, True):
        with pytest.raises(SettingError, match="--force"):
            sweep(made, more, path, resume=resume)
    assert (
        sorted(each.name for each in tmp_path.iterdir()) == ["r.parquet"]
        and path.read_bytes() == first
    )
    assert sweep(made, few, path).path.read_bytes() == first
    with pytest.raises(SweepInterruption):
        sweep(made, more, path, force=True, workers=1, progress=Stopper(4))
    assert path.read_bytes() == first
    assert sweep(made, more, path, resume=True).before > 0
    assert pq.read_table(path).num_rows == 8
    path.write_text("mine")
    with pytest.raises(OsimliteError, match="does not contain results of a sweep"):
        sweep(made, more, path)
    assert path.read_text() == "mine"
    sweep(made, more, path, force=True)
    assert pq.read_table(path).num_rows == 8


def test_a_torn_message_at_the_end_is_cut_off(made, tmp_path):
    chosen = choose_samples(made.variables, "sobol", 40, 5)
    whole = sweep(made, chosen, tmp_path / "whole.parquet").path.read_bytes()
    path, partial = tmp_path / "r.parquet", tmp_path / "r.parquet.partial"
    with pytest.raises(SweepInterruption):
        sweep(made, chosen, path, workers=1, progress=Stopper(8))
    with pytest.raises(SweepInterruption):
        sweep(made, chosen, path, resume=True, workers=1, progress=Stopper(30))
    good = partial.read_bytes()
    for cut in (1, 7, 100, 300):
        partial.write_bytes(good[:-cut])
        path.unlink(missing_ok=True)
        outcome = sweep(made, chosen, path, resume=True)
        assert 0 < outcome.before < 40 and path.read_bytes() == whole


def _ends(content: bytes) -> list[int]:
    """Return the offsets at which the records of a partial file end."""
    ends = [0]
    while ends[-1] < len(content):
        head = results.RECORD_HEAD.unpack_from(content, ends[-1])
        ends.append(ends[-1] + results.RECORD_HEAD.size + head[1])
    return ends


@pytest.fixture(scope="module")
def interrupted_three_times(tmp_path_factory):
    """Interrupt a sweep three times.

    Returns:
        Plan, samples, the complete file of results, and the partial file with several batches.
    """
    made = plan(dynamic_walker(), {"RHip_rz": (0.3, 0.5)}, to=0.05)
    chosen, folder = (
        choose_samples(made.variables, "sobol", 40, 5),
        tmp_path_factory.mktemp("sweep"),
    )
    whole = sweep(made, chosen, folder / "whole.parquet").path.read_bytes()
    for count in (8, 16, 30):
        with pytest.raises(SweepInterruption):
            sweep(
                made, chosen, folder / "r.parquet", resume=True, workers=1, progress=Stopper(count)
            )
    partial = (folder / "r.parquet.partial").read_bytes()
    assert len(_ends(partial)) == 5
    return made, chosen, whole, partial


def _flipped(content: bytes, place: int) -> bytes:
    return content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :]


def _zeroed(content: bytes, place: int) -> bytes:
    return content[:place] + bytes(min(64, len(content) - place)) + content[place + 64 :]


@pytest.mark.parametrize(
    ("damage", "part"),
    [
        *((_flipped, part) for part in ("mark", "length", "longer", "checksum", "rows", "last")),
        *((_zeroed, part) for part in ("mark", "rows", "last")),
    ],
)
@pytest.mark.parametrize("batch", [1, 3])
def test_damaged_batches_are_computed_again_and_said(
    interrupted_three_times, tmp_path, caplog, damage, part, batch
):
    made, chosen, whole, good = interrupted_three_times
    start, end = _ends(good)[batch : batch + 2]
    inside = {
        "mark": 0,
        "length": 4,
        "longer": 11,
        "checksum": 12,
        "rows": (end - start) // 2,
        "last": end - start - 1,
    }
    path = tmp_path / "r.parquet"
    damaged = damage(good, start + inside[part])
    assert damaged != good
    (tmp_path / "r.parquet.partial").write_bytes(damaged)
    outcome = sweep(made, chosen, path, resume=True)
    assert path.read_bytes() == whole
    (said,) = caplog.messages
    assert (
        "r.parquet.partial' is damaged or cut off" in said and f"first {outcome.before} run" in said
    )
    assert (outcome.before == 0) == (batch == 1)
    assert [result.name for result in tmp_path.iterdir()] == ["r.parquet"]


def test_undamaged_work_is_gone_on_with_in_silence(interrupted_three_times, tmp_path, caplog):
    made, chosen, whole, good = interrupted_three_times
    (tmp_path / "r.parquet.partial").write_bytes(good)
    outcome = sweep(made, chosen, tmp_path / "r.parquet", resume=True)
    assert (
        outcome.before >= 24
        and (tmp_path / "r.parquet").read_bytes() == whole
        and not caplog.messages
    )


@pytest.mark.parametrize("place", [0, 5, 14, 40, -1])
def test_work_damaged_at_its_beginning_is_refused(interrupted_three_times, tmp_path, place):
    made, chosen, _, good = interrupted_three_times
    damaged = _flipped(good, place % _ends(good)[1])
    (tmp_path / "r.parquet.partial").write_bytes(damaged)
    with pytest.raises(
        SettingError,
        match=r"r\.parquet\.partial' is not an interrupted sweep, or its beginning is damaged",
    ):
        sweep(made, chosen, tmp_path / "r.parquet", resume=True)
    assert [result.name for result in tmp_path.iterdir()] == ["r.parquet.partial"]
    assert (tmp_path / "r.parquet.partial").read_bytes() == damaged


def test_what_is_damaged_during_the_work_makes_no_results(tmp_path):
    partial = PartialTable(tmp_path / "r", make_schema({"run": "int64"}, {}))
    for first in (0, 2):
        partial.add([[first, first + 1]])
    content = partial.partial.read_bytes()
    partial.partial.write_bytes(_flipped(content, len(content) - 1))
    with pytest.raises(
        OsimliteError, match="has damaged the file during the sweep; continue with --resume"
    ):
        partial.finish()
    partial.close()
    assert [result.name for result in tmp_path.iterdir()] == ["r.partial"]


def test_damaged_results_are_told(tmp_path):
    partial = PartialTable(tmp_path / "r", make_schema({"run": "int64", "x": "float64"}, {"a": 1}))
    partial.add([np.arange(1000), np.random.default_rng(1).uniform(size=1000)])
    partial.finish()
    partial.close()
    content = (tmp_path / "r").read_bytes()
    (tmp_path / "r").write_bytes(_flipped(content, len(content) // 2))
    with pytest.raises(OsimliteError, match="the results are damaged"):
        compute_ranges(tmp_path / "r", ["x"])


@pytest.mark.parametrize("text", [b"[]", b"7", b"null", b'"a"', b"{", b"[" * 100_000])
def test_settings_of_another_type_are_none(tmp_path, text):
    table = make_schema({"run": "int64"}, {}).with_metadata({results.SETTINGS_KEY: text})
    pq.write_table(table.empty_table(), tmp_path / "r")
    with pytest.raises(OsimliteError, match="does not contain results of a sweep"):
        results.settings_of(tmp_path / "r")


def test_row_groups_do_not_depend_on_the_pieces(tmp_path, monkeypatch):
    monkeypatch.setattr(results, "ROWS_PER_GROUP", 10)
    table = make_schema({"run": "int64", "x": "float64", "status": "string"}, {"a": 1})
    for name, pieces in {"one": [37], "many": [1, 9, 3, 20, 4], "few": [25, 12]}.items():
        partial = PartialTable(tmp_path / name, table)
        first = 0
        for size in pieces:
            rows = np.arange(first, first + size)
            partial.add([rows, rows * 0.5, [f"s{row % 3}" for row in rows]])
            first += size
        partial.close()
        partial.finish()
    assert (
        (tmp_path / "one").read_bytes()
        == (tmp_path / "many").read_bytes()
        == (tmp_path / "few").read_bytes()
    )
    file = pq.ParquetFile(tmp_path / "one")
    assert [file.metadata.row_group(k).num_rows for k in range(file.num_row_groups)] == [
        10,
        10,
        10,
        7,
    ]
    assert compute_ranges(tmp_path / "one", ["x"])["x"] == (0.0, 0, 18.0, 36, 9.0)


def test_a_column_has_a_name_of_its_own(walker, tmp_path):
    made = plan(walker, {"RHip_rz/speed": (0.0, 1.0)}, measures=("RHip_rz/speed",), to=0.1)
    with pytest.raises(SettingError, match="two columns 'RHip_rz/speed'"):
        sweep(made, choose_samples(made.variables, "random", 4), tmp_path / "r.parquet")
    assert not list(tmp_path.iterdir())
    path = "/jointset/RightThighToPelvis/RHip_rz/speed"
    made = plan(walker, {"RHip_rz/speed": (0.0, 1.0)}, measures=(path,), to=0.1)
    sweep(made, choose_samples(made.variables, "random", 4), tmp_path / "r.parquet")
    assert {"RHip_rz/speed", path} < set(pq.read_table(tmp_path / "r.parquet").column_names)


def test_one_program_at_a_time_writes(made, tmp_path):
    """Continuing a sweep that is still running would write rows twice."""
    path, chosen = tmp_path / "r.parquet", choose_samples(made.variables, "sobol", 40, 5)
    told = []

    def interfere(done, of):
        if done and not told:
            with pytest.raises(OsimliteError) as error:
                sweep(made, chosen, path, resume=True)
            told.append(error.value.message)

    sweep(made, chosen, path, progress=interfere)
    assert "is being written" in told[0] and pq.read_table(path)["run"].to_pylist() == list(
        range(40)
    )


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a full device")
def test_a_full_disk_is_told(tmp_path):
    partial = PartialTable(tmp_path / "r", make_schema({"run": "int64"}, {}))
    partial.add([[0, 1]])
    partial.stream.close()
    partial.stream = open("/dev/full", "ab", buffering=0)  # noqa: SIM115
    with pytest.raises(
        OsimliteError,
        match="No space left on device; free some disk space, then continue with --resume",
    ):
        partial.add([[2, 3]])
    partial.close()


@pytest.mark.usefixtures("windows_files")
def test_a_table_of_results_lets_go_of_its_files_first(tmp_path):
    columns = make_schema({"run": "int64"}, {})
    PartialTable(tmp_path / "empty", columns).close()
    assert not (tmp_path / "empty.partial").exists()
    partial = PartialTable(tmp_path / "whole", columns)
    partial.add([[0, 1]])
    with partial.finish().open():
        partial.close()
        again = PartialTable(tmp_path / "whole", columns)
        again.add([[2]])
        again.finish()
        again.close()
    assert not {path.name for path in tmp_path.iterdir()} & {"empty.partial", "whole.partial"}


def test_differences_in_words():
    assert describe_differences({"a": 1, "b": [1]}, {"a": 2, "b": [2], "c": 3}) == [
        "a (1 before, 2 now)",
        "b",
        "c (None before, 3 now)",
    ]


def run_command(*words, **kwargs):
    return subprocess.Popen(
        [sys.executable, "-m", "osimlite", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **kwargs,
    )


@pytest.mark.skipif(os.name == "nt", reason="sends signals")
@pytest.mark.parametrize("signum", [signal.SIGINT, signal.SIGKILL])
def test_a_command_that_is_ended_goes_on(signum, made, tmp_path: Path, walker):
    osimlite.write(walker, tmp_path / "walker.osim")
    words = [
        "sweep", "walker.osim", "--vary", "RHip_rz=0.3:0.7", "--samples", "4000", "--to", "3", "--workers", "1",
        "--accuracy", "1e-5",
    ]  # fmt: skip
    process = run_command(*words, cwd=tmp_path)
    partial = tmp_path / "results.parquet.partial"
    deadline = time.monotonic() + 120
    start = None
    while process.poll() is None and time.monotonic() < deadline:
        size = partial.stat().st_size if partial.exists() else 0
        start = start or size or None
        if start and size > start:
            break
        time.sleep(0.05)
    process.send_signal(signum)
    _, said = process.communicate(timeout=60)
    if signum == signal.SIGINT:
        assert process.returncode == 130 and "--resume" in said, said
    assert partial.exists() and not (tmp_path / "results.parquet").exists()
    # Many runs remain, but this test does not need them.
    made = plan(
        osimlite.read(tmp_path / "walker.osim"), {"RHip_rz": "0.3:0.7"}, to=3.0, accuracy=1e-5
    )
    chosen = choose_samples(made.variables, None, 4000)
    before: list[float] = []
    with pytest.raises(SweepInterruption):
        sweep(
            made,
            chosen,
            tmp_path / "results.parquet",
            resume=True,
            progress=lambda n, of: _first(before, n),
        )
    there = PartialTable(tmp_path / "results.parquet", schema_of(made, chosen), resume=True)
    rows = []
    there.read(lambda batch: rows.extend(batch.to_pylist()))
    there.close()
    assert [row["run"] for row in rows] == list(range(len(rows))) and len(rows) >= before[0] > 0
    assert [row["RHip_rz"] for row in rows] == chosen.make_block(0, len(rows))[:, 0].tolist()


def _first(before, number):
    before.append(number)
    if number > before[0]:
        raise KeyboardInterrupt


def schema_of(made, chosen):
    from osimlite.studies.sweep.run import collect_settings

    return make_schema(made.columns("run"), collect_settings(made, chosen))


def test_memory_does_not_grow_with_the_number_of_runs(made, tmp_path):
    """The memory of Python objects is measured after the first hundred runs."""
    import tracemalloc

    chosen = choose_samples(made.variables, "lhs", 400, 5)
    peaks = []

    def note(done, of):
        if not tracemalloc.is_tracing():
            tracemalloc.start()
        peaks.append((done, tracemalloc.get_traced_memory()[0]))

    try:
        sweep(made, chosen, tmp_path / "r.parquet", workers=2, progress=note)
    finally:
        tracemalloc.stop()
    early = max(memory for done, memory in peaks if done <= 200)
    late = max(memory for done, memory in peaks if done > 200)
    assert late < early + 1e6
