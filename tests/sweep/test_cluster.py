"""A real Dask cluster on this machine: a scheduler and workers, each a process of its own, some of which are killed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest

import osimlite
from osimlite.errors import OsimliteError
from osimlite.sweep.optimize import BEST, HISTORY, SUMMARY, Objective, optimize
from osimlite.sweep.plan import plan
from osimlite.sweep.run import sweep
from osimlite.sweep.sampling import samples

pytest.importorskip("distributed", reason="needs dask.distributed (extra 'sweep')")
pq = pytest.importorskip("pyarrow.parquet", reason="needs pyarrow (extra 'sweep')")

WORKER = ["worker", "--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1"]

PATIENCE = """
import os, time

def ended(run):
    time.sleep(float(os.environ.get("SECONDS_A_RUN", "0")))
    return run.time
"""
"""A measure that takes its time on the workers: a sweep is to be interrupted, however quick the machine."""


class Cluster:
    """A scheduler and its workers."""

    def __init__(self, folder):
        self.folder, self.processes = folder, []
        (folder / "patience.py").write_text(PATIENCE)
        paths = (str(folder), *filter(None, [os.environ.get("PYTHONPATH")]))
        self.environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "SECONDS_A_RUN": "0.03"}
        self.file = folder / "scheduler.json"
        self.start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-show")
        wait_for(self.file.exists, "the scheduler's file")
        self.address = json.loads(self.file.read_text())["address"]
        for _ in range(3):
            self.start(*WORKER)

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
    while not what():
        assert time.monotonic() < deadline, f"waited for {words}"
        time.sleep(0.02)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    made = Cluster(tmp_path_factory.mktemp("cluster"))
    yield made
    made.close()


VARY = ["--vary", "RHip_rz=0.3:0.7", "--vary", "/bodyset/Pelvis/mass=1:2:log"]
SETTINGS = ["--samples", "900", "--seed", "3", "--to", "1.5", "--accuracy", "1e-3"]
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
def test_workers_and_coordinator_are_killed_and_nothing_is_lost(cluster, tmp_path, walker, monkeypatch):
    monkeypatch.syspath_prepend(str(cluster.folder))
    osimlite.write(walker, tmp_path / "walker.osim")
    vary = {"RHip_rz": "0.3:0.7", "/bodyset/Pelvis/mass": "1:2:log"}
    measures = ("distance", "patience:ended")
    here = plan(osimlite.read(tmp_path / "walker.osim"), vary, measures=measures, to=1.5)
    alone = sweep(here, samples(here.variables, None, 900, 3), tmp_path / "alone.parquet")
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
    assert "there before" in said[0]

    table = pq.read_table(tmp_path / "results.parquet").to_pydict()
    assert table["run"] == list(range(900))
    assert set(table["status"]) == {"done"}

    assert alone.path.read_bytes() == (tmp_path / "results.parquet").read_bytes()


def test_a_cluster_that_is_not_there_is_told(walker, tmp_path, monkeypatch):
    monkeypatch.setattr("osimlite.sweep.pools.PATIENCE", 1)
    made = plan(walker, {"RHip_rz": (0.3, 0.7)})
    chosen = samples(made.variables, "random", 10)
    with pytest.raises(OsimliteError, match=r"no Dask scheduler at 'tcp://127.0.0.1:1'.*dask scheduler"):
        sweep(made, chosen, tmp_path / "r.parquet", cluster="tcp://127.0.0.1:1")
    with pytest.raises(OsimliteError, match="leave out --workers"):
        sweep(made, chosen, tmp_path / "r.parquet", cluster="tcp://127.0.0.1:1", workers=2)
    assert not list(tmp_path.iterdir())


def test_a_search_finds_the_same_there(cluster, walker, tmp_path):
    pytest.importorskip("cma", reason="needs cma (extra 'optimize')")
    made = plan(walker, {"RHip_rz": (0.3, 0.7), "LHip_rz": (-0.5, 0.0)}, to=0.5)
    for name, where in (("there", {"cluster": cluster.address}), ("here", {})):
        optimize(made, Objective("distance"), tmp_path / name, budget=24, popsize=8, **where)
    for name in (HISTORY, BEST, SUMMARY):
        assert (tmp_path / "there" / name).read_bytes() == (tmp_path / "here" / name).read_bytes()


def test_functions_that_cannot_travel_are_told(cluster, walker, tmp_path):
    made = plan(walker, {"RHip_rz": (0.3, 0.7)}, measures=(lambda run: 1.0,))
    chosen = samples(made.variables, "random", 10)
    with pytest.raises(OsimliteError, match="module:function"):
        sweep(made, chosen, tmp_path / "r.parquet", cluster=cluster.address)
    # Threads of this process need to send nothing.
    assert sweep(made, chosen, tmp_path / "r.parquet").status == {"done": 10}
