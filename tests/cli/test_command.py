"""Tests of the parser of command lines: it reads them as Typer does, or leaves them to Typer."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from osimlite.base.options import list_options
from osimlite.cli import COMMANDS, create_app
from osimlite.cli._command import Command
from osimlite.cli._exiting import COMMAND_SYNONYMS
from osimlite.simulation.options import Options
from tests.cli.support import loaded
from tests.suite import choose

WORDS = [
    "walker.osim", "b.osim", "-", "1", "0", "-1", "2.5", "1e-6", ".5", "5.", "1_0", "inf", "nan", "x", "a=1", "a==", "",
    "--", "-p", "-o", "-ofolder", "-o=x", "--output", "--no", "--help", "é", "٣",
]  # fmt: skip


def by_typer(name: str, words: list[str], monkeypatch: pytest.MonkeyPatch) -> dict[str, Any] | None:
    """Return the values that Typer passes to the function of a command.

    Args:
        name: the command.
        words: its arguments.
        monkeypatch: replaces the call of the command.

    Returns:
        Values by parameter; None if Typer rejects the words or shows the help.
    """
    seen: list[dict[str, Any]] = []
    with monkeypatch.context() as patch:
        patch.setattr(Command, "__call__", lambda self, **values: seen.append(values))
        try:
            create_app([name])(args=[name, *words], standalone_mode=False)
        except Exception as error:
            assert hasattr(error, "format_message"), error
    return seen[0] if seen else None


def spellings(name: str) -> list[str]:
    return [
        word
        for each in loaded(name).parameters()
        for word in each.spellings
        if each.declared.maker == "Option"
    ]


@settings(max_examples=choose(15, 60), deadline=None)
@given(data=st.data())
@pytest.mark.parametrize(
    "name", ["simulate", "validate", "translate", "view", "find-gait", "gait", "diff", "build"]
)
def test_what_is_read_is_what_typer_reads(name: str, data: st.DataObject) -> None:
    word = st.sampled_from(WORDS)
    option = st.sampled_from(spellings(name))
    part = st.one_of(
        st.tuples(word), st.tuples(option), st.tuples(option, word),
        st.builds(lambda left, right: (f"{left}={right}",), option, word),
    )  # fmt: skip
    words = [
        "walker.osim",
        *(each for few in data.draw(st.lists(part, max_size=5)) for each in few),
    ]
    result = loaded(name).read(words)
    if result is not None:
        assert result == by_typer(name, words, pytest.MonkeyPatch()), words


@pytest.mark.parametrize("name", COMMANDS)
def test_defaults_are_those_of_typer(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    needed = [each for each in loaded(name).parameters() if each.default is ...]
    words = [f for each in needed for f in ("x",) if each.declared.maker == "Argument"]
    words += [
        f
        for each in needed
        if each.declared.maker == "Option"
        for f in (next(iter(each.spellings)), "x")
    ]
    result = loaded(name).read(words)
    assert result is not None and result == by_typer(name, words, monkeypatch)


def test_what_is_wrong_is_left_to_typer() -> None:
    read = loaded("simulate").read
    assert read(["a.osim", "--to", "2", "--plot"]) is not None
    for wrong in (
        [],
        ["a", "b"],
        ["a", "--two"],
        ["a", "--to"],
        ["a", "--to", "x"],
        ["a", "--plot=1"],
        ["--help"],
    ):
        assert read(wrong) is None
    assert loaded("find-gait").read(["a", "--digits", "18"]) is None
    assert loaded("find-gait").read(["a", "--digits", "17"]) is not None


def test_an_option_of_a_simulation_is_declared_once() -> None:
    taken = {each.name: each for each in loaded("simulate").parameters()}
    for choice in list_options(Options):
        default = getattr(Options(), choice.name)
        assert taken[choice.name].default == choice.default
        # A default of None with a text means that the option is omitted and the library's default
        # applies.
        assert choice.default == default or (
            choice.default is None and choice.default_text == f"{default}"
        )
        assert f"{choice.name}: {choice.help.split()[0]}" in (Options.__doc__ or "")
    for name in ("sweep", "optimize", "gait", "muscles"):
        for each in loaded(name).parameters():
            same = taken.get(each.name)
            if same is not None and each.name in (
                "wrapping",
                "skip_unsupported",
                "integrator",
                "equilibrate",
            ):
                assert (
                    each.declared.settings == same.declared.settings
                    and each.default == same.default
                )


def test_python_does_not_look_through_all_objects_at_the_end() -> None:
    # Functions of `atexit` run in reverse order: the first registered is called last.
    told = "import atexit, gc; atexit.register(lambda: print(gc.get_freeze_count() > 1000))"
    script = f"{told}; from osimlite.cli import main; main(['--version'])"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.split()[-1] == "True"


def test_synonyms_name_commands_that_exist():
    assert not {*COMMAND_SYNONYMS} & {*COMMANDS}
    assert {words.split()[0] for words in COMMAND_SYNONYMS.values()} <= {*COMMANDS}
