"""What the commands say of themselves: it fits a terminal, and one option is the same everywhere."""

from __future__ import annotations

from collections import defaultdict

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from osimlite.cli import COMMANDS, create_app

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
    "--perturb": "once or often",
    "--samples": "of a sweep, or walkers",
    "--report-interval": "of the result files, or of what a measure looks at",
}
"""Options whose help differs between commands, and why."""


@pytest.fixture(scope="module")
def application():
    return create_app()


@pytest.mark.parametrize("command", COMMANDS)
def test_help_fits_80_columns(application, command, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    done = CliRunner().invoke(application, [command, "--help"])
    assert done.exit_code == 0
    assert "…" not in done.output and max(map(len, done.output.splitlines())) <= 80


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
