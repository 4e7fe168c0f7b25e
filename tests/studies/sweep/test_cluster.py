"""Tests of sweeps on a Dask cluster of processes on this machine, some of which are killed."""

from __future__ import annotations

import importlib
import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from importlib.util import find_spec

import pytest

import osimlite
from osimlite.errors import OsimliteError, SettingError
from osimlite.studies.sweep.optimize import (
    BEST_FILE,
    HISTORY_FILE,
    SUMMARY_FILE,
    Objective,
    optimize,
)
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.run import sweep
from osimlite.studies.sweep.sampling import choose_samples
from tests.studies.sweep.support import pulled

if find_spec("distributed") is None:
    pytest.skip("needs dask.distributed (extra 'sweep')", allow_module_level=True)
pq = pytest.importorskip("pyarrow.parquet", reason="needs pyarrow (extra 'sweep')")

WORKER = ["worker", "--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1"]

PATIENCE = """
import os, time

def ended(run):
    time.sleep(float(os.environ.get("SECONDS_A_RUN", "0")))
    return run.time
"""
"""Measure that takes time on the workers, so that a sweep can be interrupted on machines of any speed."""


class Cluster:
    """Dask scheduler and its workers, each in a process."""

    def __init__(self, folder):
        self.folder, self.processes = folder, []
        (folder / "patience.py").write_text(PATIENCE)
        paths = (str(folder), *filter(None, [os.environ.get("PYTHONPATH")]))
        self.environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(paths),
            "SECONDS_A_RUN": "0.03",
        }
        self.file = folder / "scheduler.json"
        self.start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-show")
        self.address = wait_for(self.told_address, "the scheduler's file")
        for _ in range(3):
            self.start(*WORKER)

    def told_address(self):
        """Return the address in the scheduler's file, or None while the file is incomplete."""
        try:
            return json.loads(self.file.read_text())["address"]
        except (FileNotFoundError, ValueError):
            return None

    def start(self, *words):
        log = (self.folder / f"{len(self.processes)}.log").open("w")
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", *words, "--scheduler-file", str(self.file)],
            stdout=log, stderr=subprocess.STDOUT, cwd=self.folder, env=self.environment,
        )  # fmt: skip
        log.close()
        self.processes.append(process)
        return process

    def close(self):
        for process in self.processes:
            process.kill()
            process.wait()


def wait_for(what, words, seconds=120):
    deadline = time.monotonic() + seconds
    while not (result := what()):
        assert time.monotonic() < deadline, f"waited for {words}"
        time.sleep(0.02)
    return result


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    made = Cluster(tmp_path_factory.mktemp("cluster"))
    yield made
    made.close()


VARY = ["--vary", "RHip_rz=0.3:0.7", "--vary", "/bodyset/Pelvis/mass=1:2:log"]
SETTINGS = ["--samples", "420", "--seed", "3", "--to", "1.5", "--accuracy", "1e-3"]
MEASURES = ["--measure", "distance", "--measure", "patience:ended"]


@contextmanager
def command(cluster, folder, *words):
    process = subprocess.Popen(
        [
            *(sys.executable, "-m", "osimlite", "sweep", "walker.osim"),
            *(*VARY, *SETTINGS, *MEASURES, "--cluster", cluster.address, *words),
        ],
        cwd=folder,
        env=cluster.environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@pytest.mark.skipif(os.name == "nt", reason="sends signals")
@pytest.mark.full
def test_workers_and_coordinator_are_killed_and_nothing_is_lost(
    cluster, tmp_path, walker, monkeypatch
):
    monkeypatch.syspath_prepend(str(cluster.folder))
    osimlite.write(walker, tmp_path / "walker.osim")
    vary = {"RHip_rz": "0.3:0.7", "/bodyset/Pelvis/mass": "1:2:log"}
    measures = ("distance", "patience:ended")
    here = plan(osimlite.read(tmp_path / "walker.osim"), vary, measures=measures, to=1.5)
    alone = sweep(here, choose_samples(here.variables, None, 420, 3), tmp_path / "alone.parquet")
    partial = tmp_path / "results.parquet.partial"

    def grows(process):
        sizes = set()

        def has_grown():
            assert process.poll() is None, process.communicate()
            sizes.add(partial.stat().st_size if partial.exists() else 0)
            return len(sizes - {0}) > 1

        return has_grown

    with command(cluster, tmp_path) as first:
        wait_for(grows(first), "the first results")
        first.send_signal(signal.SIGKILL)
        first.wait(10)
    kept = partial.stat().st_size

    with command(cluster, tmp_path, "--resume") as second:
        wait_for(grows(second), "more results")
        cluster.processes[1].send_signal(signal.SIGKILL)
        said = second.communicate(timeout=120)
        assert second.returncode == 0, said
    assert not partial.exists() and kept > 0
    assert "done before" in said[0]

    table = pq.read_table(tmp_path / "results.parquet").to_pydict()
    assert table["run"] == list(range(420))
    assert set(table["status"]) == {"done"}

    assert alone.path.read_bytes() == (tmp_path / "results.parquet").read_bytes()


def test_a_cluster_that_is_not_there_is_told(walker, tmp_path, monkeypatch):
    monkeypatch.setattr("osimlite.base.pools.CLUSTER_TIMEOUT_S", 1)
    made = plan(walker, {"RHip_rz": (0.3, 0.7)})
    chosen = choose_samples(made.variables, "random", 10)
    with pytest.raises(
        OsimliteError, match=r"no Dask scheduler at 'tcp://127.0.0.1:1'.*dask scheduler"
    ):
        sweep(made, chosen, tmp_path / "r.parquet", cluster="tcp://127.0.0.1:1")
    for address, words in (
        ("scheduler", "'scheduler' is not an address .*missing port.*tcp://127.0.0.1:8786"),
        ("http://127.0.0.1:8786", "unknown address scheme"),
    ):
        with pytest.raises(SettingError, match=words):
            sweep(made, chosen, tmp_path / "r.parquet", cluster=address)
    with pytest.raises(OsimliteError, match="remove --workers"):
        sweep(made, chosen, tmp_path / "r.parquet", cluster="tcp://127.0.0.1:1", workers=2)
    assert not list(tmp_path.iterdir())


@pytest.mark.full
def test_a_search_finds_the_same_there(cluster, tmp_path):
    pytest.importorskip("cma", reason="needs cma (extra 'optimize')")
    vary = {"m*/control@0:0.03:3": (0.0, 1.0), "mu/max_isometric_force@scale": (0.5, 2.0)}
    made = plan(pulled(), vary, to=0.03, equilibrate=True)
    for name, where in (("there", {"cluster": cluster.address}), ("here", {})):
        optimize(
            made,
            Objective("max(x) + integral(mu/control^2)"),
            tmp_path / name,
            budget=24,
            popsize=8,
            **where,
        )
    for name in (HISTORY_FILE, BEST_FILE, SUMMARY_FILE):
        assert (tmp_path / "there" / name).read_bytes() == (tmp_path / "here" / name).read_bytes()


def test_functions_that_cannot_travel_are_told(cluster, walker, tmp_path):
    made = plan(walker, {"RHip_rz": (0.3, 0.7)}, measures=(lambda run: 1.0,))
    chosen = choose_samples(made.variables, "random", 10)
    with pytest.raises(OsimliteError, match="module:function"):
        sweep(made, chosen, tmp_path / "r.parquet", cluster=cluster.address)
    # Threads of this process need no serialization.
    assert sweep(made, chosen, tmp_path / "r.parquet").status == {"done": 10}


def test_workers_that_cannot_do_the_task_are_told(cluster, walker, tmp_path, monkeypatch):
    """Workers lack a module that is on the path of this machine only, or have another version of osimlite."""
    (tmp_path / "only_here.py").write_text("def one(run):\n    return 1.0\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    one = importlib.import_module("only_here").one

    chosen = choose_samples(plan(walker, {"RHip_rz": (0.3, 0.7)}).variables, "random", 10)
    for measure in (one, "only_here:one"):
        made = plan(walker, {"RHip_rz": (0.3, 0.7)}, measures=(measure,), to=0.1)
        with pytest.raises(OsimliteError, match="only_here"):
            sweep(made, chosen, tmp_path / "r.parquet", cluster=cluster.address)
    monkeypatch.setattr("osimlite.__version__", "0.0.1")
    made = plan(walker, {"RHip_rz": (0.3, 0.7)}, to=0.1)
    with pytest.raises(
        OsimliteError,
        match=r"a worker has osimlite .*, but the sweep was started by osimlite 0\.0\.1",
    ):
        sweep(made, chosen, tmp_path / "r.parquet", cluster=cluster.address)
    assert not list(tmp_path.glob("*.parquet*"))


@pytest.mark.skipif(os.name == "nt", reason="sends signals")
@pytest.mark.full
def test_a_scheduler_that_goes_is_told_and_nothing_is_lost(
    tmp_path_factory, walker, tmp_path, monkeypatch
):
    lost = Cluster(tmp_path_factory.mktemp("lost"))
    try:
        monkeypatch.syspath_prepend(str(lost.folder))
        made = plan(
            walker, {"RHip_rz": (0.3, 0.7)}, measures=("distance", "patience:ended"), to=0.3
        )
        chosen = choose_samples(made.variables, "random", 900)

        def end(done, of):
            if done > 40:
                lost.processes[0].kill()

        import distributed

        # Workers start slowly on a busy machine; only the wait for a scheduler that has ended is
        # short.
        with distributed.Client(lost.address, set_as_default=False) as client:
            client.wait_for_workers(1, timeout=120)
        monkeypatch.setattr("osimlite.base.pools.CLUSTER_TIMEOUT_S", 5)
        # The number of workers is requested after every task, also right after the scheduler was
        # killed.
        monkeypatch.setattr("osimlite.base.pools.WORKER_COUNT_AGE_S", 0.0)
        with pytest.raises(OsimliteError, match="does not answer any more; continue with --resume"):
            sweep(made, chosen, tmp_path / "r.parquet", cluster=lost.address, progress=end)
    finally:
        lost.close()
    few = sweep(made, chosen, tmp_path / "r.parquet", resume=True)
    assert few.before > 0 and few.before + few.status["done"] == 900
    whole = sweep(made, chosen, tmp_path / "whole.parquet").path.read_bytes()
    assert (tmp_path / "r.parquet").read_bytes() == whole
