"""``osimlite scone``: simulate or optimize a scenario of SCONE."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from osimlite.cli import _options as options
from osimlite.cli._command import Argument, Option, command

UNITS = {
    "speed": "m/s",
    "power": "W/kg",
    "transport": "J/(kg m)",
    "jump height": "cm",
    "early rise": "cm",
}
"""Units of the quantities that measures report."""

LABELS = {"transport": "cost of transport"}
"""Display names of quantities, where they differ from those of the measures."""


@command
def scone(
    scenario: Annotated[
        Path,
        Argument(
            metavar="SCENARIO",
            help="A .scone or YAML file, or 'human-walks', a built-in scenario, which is copied to the output folder.",
            show_default=False,
        ),
    ],
    par: options.Par = None,
    optimize: Annotated[bool, Option("--optimize", help="Optimize the parameters.")] = False,
    generations: Annotated[
        int | None,
        Option(
            metavar="N", help="Number of generations.", show_default="that of the scenario, or 1000"
        ),
    ] = None,
    population: Annotated[
        int | None,
        Option(
            metavar="N",
            help="Candidates in each generation.",
            show_default="that of the scenario, or 16",
        ),
    ] = None,
    seed: Annotated[
        int | None,
        Option(
            help="Seed of the random numbers; equal seeds give equal searches.",
            show_default="that of the scenario, or 0",
        ),
    ] = None,
    duration: Annotated[
        float | None,
        Option(
            "--to",
            metavar="SECONDS",
            help="Duration of the simulation. With --optimize, only of the last one, with the best parameters: "
            "the duration of the candidates is max_duration of the scenario.",
            show_default="that of the scenario",
        ),
    ] = None,
    resume: Annotated[bool, Option("--resume", help="Continue an interrupted search.")] = False,
    output: Annotated[
        Path,
        Option(
            "-o",
            "--output",
            metavar="FOLDER",
            help="Folder for states.sto, excitations.sto, best.par.",
        ),
    ] = Path("scone"),
) -> None:
    """Run a SCONE scenario: simulate its human model walking by reflexes, or optimize the parameters.

    docs/reflexes.md lists the supported parts of SCONE, and how to write a controller. Other parts
    are reported as errors, with their line.

    To look at the result: osimlite view walk/human.osim walk/states.sto

    Example: osimlite scone human-walks -o walk
    """
    from osimlite.base.files import make_folder
    from osimlite.cli._console import FactTable, show
    from osimlite.errors import SettingError
    from osimlite.io.tables.storage import write_sto
    from osimlite.models.walking import SCENARIO, write_scenario
    from osimlite.studies.reflexes.gait import measure_gait
    from osimlite.studies.reflexes.parameters import read_par
    from osimlite.studies.reflexes.scenario import Scenario
    from osimlite.studies.reflexes.search import BEST_FILE, search_parameters

    if not optimize and (
        resume or any(loaded is not None for loaded in (generations, population, seed))
    ):
        raise SettingError(
            "--generations, --population, --seed and --resume are options of a search; add --optimize"
        )
    # A copy, so that users can edit it.
    if str(scenario) == SCENARIO:
        scenario = write_scenario(output)
    loaded = Scenario(scenario)
    values = (
        loaded.best()
        if par is None
        # The first number is the best value, the others are the spread of the search.
        else {name: parameter_values[0] for name, parameter_values in read_par(par).items()}
    )
    files = []
    if optimize:
        values = search_parameters(
            loaded,
            output,
            generations=generations,
            population=population,
            seed=seed,
            resume=resume,
            report=lambda generation: show(f"{generation}\n", err=True),
        )
        files.append(output / BEST_FILE)
    walk = loaded.walk(values, duration=duration)
    make_folder(output)
    for name, table in (
        ("states", walk.states),
        ("excitations", walk.excitations),
        ("loads", walk.loads),
    ):
        files.append(output / f"{name}.sto")
        write_sto(files[-1], name, table.times, table.columns, table.rows)
    facts = FactTable(f"{loaded.model.name} {walk.times[0]:.3f} s")
    facts.add("result", f"{walk.results[0]:.6g}")
    for name, term in walk.terms.items():
        facts.add(name, f"{term[0]:.6g}")
    for name, report in walk.report.items():
        facts.add(LABELS.get(name, name), f"{report[0]:.6g} {UNITS.get(name, '')}".rstrip())
    gait = measure_gait(loaded, walk)
    for name, gait_text in () if gait is None else gait.describe().items():
        facts.add(name, gait_text)
    facts.add_files(files)
    facts.show()
