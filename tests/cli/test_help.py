"""Tests of the help of commands: it fits a terminal, and an option means the same in every command."""

from __future__ import annotations

from collections import defaultdict

import pytest
from typer.main import get_command

from osimlite.cli import COMMANDS, create_app, load_command
from osimlite.cli._help import format_help
from tests.cli.command import run

MEANINGS = {
    "--to": "seconds, but the format of translate and convert",
    "--from": "seconds, but the format that convert reads, or the program of modify",
    "--output": "a file or a folder, as the command writes",
    "--seed": "of what it makes random",
    "--all": "findings of validate, or classes of info",
    "--accuracy": "the step map of gait takes a finer one",
    "--set": "where a motion starts, but the pose that view shows",
    "--diff": "of mends, or of layout",
    "--plot": "a motion, or muscles",
    "--measure": "to keep of a run, or in the history of a search",
    "--resume": "a sweep, or a search",
    "--pictures": "of a basin, or of a walk",
    "--force": "over results of a sweep, or of a search",
    "--budget": "runs, or models",
    "--forces": "shown in a picture or plot, or pushing besides",
    "--check": "of how text is laid out, or of a file of MuJoCo's",
    "--overwrite": "results of tools, or of conversions",
    "--perturb": "once or often",
    "--samples": "of a sweep, or walkers",
    "--report-interval": "of the result files, or of what a measure looks at",
}
"""Options whose meaning differs between commands, with the meanings."""


SCREEN_LINES = 45
"""Lines of a terminal that fills the screen of a laptop; no help is longer than two screens."""
SMALL_SCREEN_LINES = 38
"""Lines of a smaller terminal; the help of `optimize`, `sweep` and `simulate` fits on two screens of it."""


@pytest.fixture(scope="module")
def application():
    return create_app()


@pytest.mark.parametrize("command", COMMANDS)
def test_help_fits_80_columns_and_two_screens(command):
    lines = format_help(command, load_command(command), 80).splitlines()
    assert max(map(len, lines)) <= 80
    is_short = command in ("optimize", "sweep", "simulate")
    assert len(lines) <= 2 * (SMALL_SCREEN_LINES if is_short else SCREEN_LINES)


def test_long_helps_have_groups_that_have_each_option_once():
    lines = format_help("optimize", load_command("optimize"), 80).splitlines()
    headings = [line for line in lines if line.endswith(":") and not line.startswith(" ")]
    assert headings == ["Arguments:", "Options:", "Search:", "Simulation:"]
    starts = [lines.index(heading) for heading in headings]
    rows = {line.split()[0]: number for number, line in enumerate(lines) if line[:3] == "  -"}
    assert starts[1] < rows["--objective"] < starts[2] < rows["--method"] < starts[3] < rows["--to"]
    assert sum("--help" in line for line in lines) == 1 and starts[1] < rows["-h,"] < starts[2]
    for name in ("optimize", "sweep"):
        command = load_command(name)
        names = {parameter.name for parameter in command.parameters()}
        grouped = [member for group in command.groups.values() for member in group]
        assert names >= set(grouped) and len(grouped) == len(set(grouped))


def test_a_pair_of_files_has_no_dots():
    text = format_help("diff", load_command("diff"), 80)
    assert "OLD NEW\n" in text and "NEW..." not in text
    assert "PATH...\n" in format_help("validate", load_command("validate"), 80)


def test_the_help_of_the_program_names_all_commands_and_options(application):
    done = run("--help")
    assert done.code == 0 and max(map(len, done.out.splitlines())) <= 80
    for name in COMMANDS:
        assert f"\n  {name} " in done.out
    group = get_command(application)
    for parameter in group.params:
        for spelling in parameter.opts:
            assert spelling in done.out


def test_help_names_every_option_with_its_default(application):
    for name, command in get_command(application).commands.items():
        text = format_help(name, load_command(name), 80)
        for option in command.params:
            if option.param_type_name == "option" and option.name != "help":
                assert all(word in text for word in (*option.opts, *option.secondary_opts))
    text = format_help("sweep", load_command("sweep"), 80)
    assert "--to SECONDS" in text and "[default: 2.0]" in text and "\033" not in text
    assert "\033[1m--to SECONDS\033[0m" in format_help(
        "sweep", load_command("sweep"), 80, bold=True
    )


def test_help_is_printed_without_typer(tmp_path):
    for words in (("optimize", "--help"), ("run-tool", "-h"), ("ik", "a.osim", "--help")):
        done = run(*words, folder=tmp_path)
        assert (done.code, done.err) == (0, "") and done.out.startswith("Usage: osimlite ")


def test_an_option_is_the_same_in_every_command(application):
    result = defaultdict(set)
    for command in get_command(application).commands.values():
        for option in command.params:
            if option.param_type_name == "option":
                name = max(option.opts, key=len)
                result[name].add((tuple(option.opts), option.metavar, option.help))
    different = {name for name, forms in result.items() if len(forms) > 1}
    assert different == set(MEANINGS)
    spellings = {name: {form[0] for form in forms} for name, forms in result.items()}
    assert all(len(each) == 1 for each in spellings.values()), spellings
