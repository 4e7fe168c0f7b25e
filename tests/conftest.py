"""Fixtures of all tests: the repository, its inputs, the shared reference data and the models of the corpus."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from hypothesis import settings

from osimlite.schema.model import Model
from tests import separate
from tests.bare import BareEnvironment
from tests.search_paths import restore_search_paths
from tests.simple_models import read_walker
from tests.suite import Suite

# tests/test_suite.py and tests/test_separate.py run pytest on small projects.
pytest_plugins = ["pytester"]

ROOT = Path(__file__).resolve().parent.parent
# Reference data too large to commit, in a folder next to the repository; tests that need it skip
# without it.
SHARED = Path(os.environ.get("OSIMLITE_SHARED") or ROOT.parent / "shared")
NO_SHARED = "needs the shared reference folder, which is not beside this repository"
ROUNDED = {"m0079": 1e-6, "m0109": 1e-7, "m0168": 1e-7, "m0172": 1e-8}
"""Tolerances of poses for corpus models whose file has more digits than OpenSim keeps when it converts the file.

All other models have a tolerance of 1e-10.
"""

# No deadline: a busy machine must not fail a property. The examples are the same in every run, so
# that no run fails for one that comes once in a month. `--hypothesis-seed` takes others; the nightly
# workflow does so.
settings.register_profile("osimlite", deadline=None, derandomize=True, print_blob=True)
settings.register_profile("osimlite-quick", settings.get_profile("osimlite"), max_examples=40)
settings.load_profile("osimlite")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options that select the tests and their order."""
    parser.addoption(
        "--full",
        action="store_true",
        help="run all tests, also those marked `full` (release, nightly)",
    )
    parser.addoption(
        "--shuffle",
        type=int,
        metavar="SEED",
        help="run the files, and the tests of each, in the random order of this seed",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Register the plugins of the suite, and make processes that tests start interruptible.

    A shell that starts pytest in the background makes it ignore SIGINT, and its child processes
    inherit that.
    """
    config.pluginmanager.register(
        Suite(config.getoption("--full"), config.getoption("--shuffle")), "osimlite-suite"
    )
    profile = "osimlite" if config.getoption("--full") else "osimlite-quick"
    # Without hypothesis's plugin (-p no:hypothesispytest) the option does not exist.
    if config.getoption("--hypothesis-seed", None) is not None:
        settings.register_profile("osimlite-seed", settings.get_profile(profile), derandomize=False)
        profile = "osimlite-seed"
    settings.load_profile(profile)
    if not separate.is_server(config):
        config.pluginmanager.register(separate, "osimlite-check-protocol")
        config.pluginmanager.register(separate.Checks(config), "osimlite-checks")
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


ENGINES = {"bullet": "pybullet", "compiled": "numpy"}
"""Package that each engine needs."""


QUICK_CORPUS = {
    "m0072", "m0093", "m0113", "m0117", "m0119", "m0123", "m0134", "m0139", "m0153", "m0166", "m0178", "m0181", "m0321",
    "m0356", "m0459", "m0466", "m0472", "m0713",
}  # fmt: skip
"""Corpus models of the quick suite: the smallest that together contain three quarters of all classes in the corpus."""


class CorpusModel(NamedTuple):
    """Model file of the corpus, with reference data from OpenSim 4.6."""

    id: str
    path: Path  # as published
    truth: Path  # OpenSim's components, poses and energies: gzipped JSON
    # OpenSim's own print of the file, gzipped; None if OpenSim cannot load the file
    converted: Path | None


def corpus_models() -> list[CorpusModel]:
    """Return all models of the shared corpus in the order of their ids; an empty list without the folder."""
    result = []
    for path in sorted(SHARED.glob("corpus/models/*/*.osim")):
        name = path.parent.name
        converted = SHARED / "corpus" / "converted" / f"{name}.osim.gz"
        truth = SHARED / "corpus" / "truth" / f"{name}.json.gz"
        result.append(CorpusModel(name, path, truth, converted if converted.exists() else None))
    return result


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run a test with the argument `corpus_model` once per model of the corpus; the quick suite runs some of them."""
    if "corpus_model" in metafunc.fixturenames:
        models: list[object] = [
            pytest.param(
                model, id=model.id, marks=() if model.id in QUICK_CORPUS else pytest.mark.full
            )
            for model in corpus_models()
        ]
        absent = pytest.param(None, id="absent", marks=pytest.mark.skip(reason=NO_SHARED))
        metafunc.parametrize("corpus_model", models or [absent])


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup() -> None:
    """Restore the search paths of programs and libraries, which OpenSim's import changes.

    tests/oracle/conftest.py does the same while tests are collected, before workers inherit these
    variables.
    """
    restore_search_paths()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests that read the corpus for `-m "not corpus"`, and skip cases of engines that are not installed."""
    missing = [engine for engine, package in ENGINES.items() if find_spec(package) is None]
    for item in items:
        cases = (
            item.callspec.params.values()
            if isinstance(item, pytest.Function) and hasattr(item, "callspec")
            else ()
        )
        for engine in missing:
            if engine in [case for case in cases if isinstance(case, str)]:
                item.add_marker(pytest.mark.skip(reason=f"needs {ENGINES[engine]}"))
        if {"corpus", "corpus_model"} & set(getattr(item, "fixturenames", ())):
            item.add_marker("corpus")


@pytest.fixture(scope="session", autouse=True)
def terminal_width() -> Iterator[None]:
    """Set the width of tables to 80 columns, whatever the width of the terminal."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", "80")
        yield


@pytest.fixture(scope="session")
def repo() -> Path:
    """Return the root of the repository."""
    return ROOT


@pytest.fixture(scope="session")
def fixtures() -> Path:
    """Return the folder of the small inputs that are committed with the tests."""
    return ROOT / "fixtures"


@pytest.fixture(scope="session")
def bare(tmp_path_factory: pytest.TempPathFactory) -> BareEnvironment:
    """Return an environment with only the base dependencies."""
    return BareEnvironment(tmp_path_factory.mktemp("bare") / "environment")


@pytest.fixture
def walker() -> Model:
    """Return the dynamic walker as OpenSim wrote it, a new model for each test."""
    return read_walker()


@pytest.fixture(scope="session")
def shared() -> Path:
    """Return the shared reference folder."""
    if not SHARED.is_dir():
        pytest.skip(NO_SHARED)
    return SHARED


@pytest.fixture(scope="session")
def corpus(shared: Path) -> list[CorpusModel]:
    """Return all models of the corpus; use `corpus_model` instead to run a test once per model."""
    models = corpus_models()
    if not models:
        pytest.skip("needs the folder of real models (corpus) in the shared reference folder")
    return models


@pytest.fixture
def exact_names(tmp_path: Path) -> None:
    """Skip the test on a file system that ignores the case of letters."""
    (tmp_path / "a").touch()
    if (tmp_path / "A").exists():
        pytest.skip("this file system finds a name in any letter case")
    (tmp_path / "a").unlink()


DESCRIPTORS = Path("/proc/self/fd")


@pytest.fixture
def windows_files(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forbid to remove or replace open files, as Windows does; writing to them stays possible."""
    if not DESCRIPTORS.exists():
        pytest.skip("only Linux tells which files are open")

    def guarded(does: Callable[..., None]) -> Callable[..., None]:
        def refuse(*paths: str | Path, **words: Any) -> None:
            at_stake = {os.path.realpath(path) for path in paths}
            if not at_stake.isdisjoint(
                os.path.realpath(handle) for handle in DESCRIPTORS.iterdir()
            ):
                raise PermissionError(13, "Permission denied")
            does(*paths, **words)

        return refuse

    for name in ("replace", "rename", "unlink", "remove"):
        monkeypatch.setattr(os, name, guarded(getattr(os, name)))
