"""Moco studies as files, and random faults that only studies can have."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import osimlite
from osimlite.io.tables.storage import write_sto
from tests.lint.project_faults import KINDS as GENERAL
from tests.lint.projects import Change, Project, misspelt
from tests.optimal.small import BODIES, TIMES, coupled, links, study_of, tables

SWING = "/jointset/j0/q0/value"
MOTORS = "/forceset/motor0", "/forceset/motor1"


def _followed():
    table = osimlite.TableProcessor
    control = osimlite.MocoControlTrackingGoalReference(name=MOTORS[0], reference=MOTORS[0])
    marked = osimlite.MarkersReference(marker_file="markers.trc")
    marked.marker_weights.objects.append(osimlite.MarkerWeight(name="tip", weight=2.0))
    goals = [
        osimlite.MocoStateTrackingGoal(name="states", reference=table(filepath="motion.sto"), pattern=".*/value",
                                       allow_unused_references=True),
        osimlite.MocoControlTrackingGoal(name="controls", reference=table(filepath="controls.sto"),
                                         reference_labels=[control]),
        osimlite.MocoMarkerTrackingGoal(name="markers", markers_reference=marked),
        osimlite.MocoControlGoal(name="effort", weight=0.1),
    ]  # fmt: skip
    goals[0].state_weights.objects.append(osimlite.MocoWeight(name=SWING, weight=3.0))
    goals[3].control_weights.objects.append(osimlite.MocoWeight(name=MOTORS[1], weight=3.0))
    bound = osimlite.MocoControlBoundConstraint(
        name="bound", control_paths=MOTORS[:1], lower_bound=osimlite.Constant(value=0.1)
    )
    below = osimlite.MocoStateBoundConstraint(name="below", state_paths=(SWING,),
                                              upper_bound=osimlite.LinearFunction(coefficients=(0.5, 0.9)))  # fmt: skip
    study = study_of(links(), *goals, constraints=[bound, below], guess_file="guess.sto")
    study.problem.phases.state_infos.append(
        osimlite.MocoVariableInfo(name=SWING, bounds=(-1.0, 1.0), initial_bounds=(0.0,))
    )
    return study


def _locate_part():
    pair = osimlite.MocoFrameDistanceConstraintPair(
        frame1_path="/ground", frame2_path=BODIES[1], minimum_distance=0.1, maximum_distance=3.0
    )
    repeated = osimlite.MocoPeriodicityGoalPair(initial_variable=SWING, final_variable=SWING)
    goals = [
        osimlite.MocoTranslationTrackingGoal(name="places", frame_paths=BODIES,
                                             translation_reference_file="vectors.sto"),
        osimlite.MocoOrientationTrackingGoal(name="turns", frame_paths=BODIES[1:],
                                             states_reference=osimlite.TableProcessor(filepath="motion.sto")),
        osimlite.MocoMarkerFinalGoal(name="end", point_name="/markerset/tip", reference_location=(0.1, 0.2, 0.3)),
        osimlite.MocoOutputGoal(name="output", output_path="/bodyset/b1|linear_acceleration", output_index=1,
                                exponent=2),
        osimlite.MocoPeriodicityGoal(name="cycle", state_pairs=[repeated]),
        osimlite.MocoFinalTimeGoal(name="time"),
    ]  # fmt: skip
    goals[0].translation_weights.objects.append(osimlite.MocoWeight(name=BODIES[1], weight=2.0))
    away = osimlite.MocoFrameDistanceConstraint(name="away", frame_pairs=[pair])
    study = study_of(
        links(),
        *goals,
        constraints=[away],
        transcription_scheme="legendre-gauss-2",
        mesh=(0.0, 0.4, 1.0),
    )
    mass = osimlite.MocoParameter(
        name="mass",
        moco_bounds=osimlite.MocoBounds(bounds=(0.5, 2.0)),
        component_paths=BODIES[1:],
        property_name="mass",
    )
    study.problem.phases.parameters.append(mass)
    return study


def _pushed():
    group = osimlite.MocoContactTrackingGoalGroup(
        contact_force_paths=("/forceset/contact1",),
        external_force_name="foot",
        alternative_frame_paths=BODIES[:1],
    )
    goals = [
        osimlite.MocoContactTrackingGoal(name="contact", contact_groups=[group], external_loads_file="loads.xml",
                                         projection="plane", projection_vector=(1.0, 0.2, 0.0)),
        osimlite.MocoJointReactionGoal(name="load", joint_path="/jointset/j1", loads_frame="child",
                                       reaction_measures=("force-x", "moment-z")),
        osimlite.MocoGeneralizedForceTrackingGoal(name="forces", force_paths=("/forceset/contact0",),
                                                  reference=osimlite.TableProcessor(filepath="moments.sto")),
        osimlite.MocoInitialActivationGoal(name="start", mode="cost"),
    ]  # fmt: skip
    goals[1].reaction_weights.objects.append(osimlite.MocoWeight(name="force-x", weight=2.0))
    goals[2].ignore_constrained_coordinates = False
    return study_of(coupled(links("implicit"), "q1"), *goals, multibody_dynamics_mode="implicit")


def project(kind: str, folder: Path) -> Project:
    """Write a study with its model and tables into a folder, and return its texts.

    Args:
        kind: "followed", "placed" or "pushed".
        folder: the folder.
    """
    study = {"followed": _followed, "placed": _locate_part, "pushed": _pushed}[kind]()
    tables(folder)
    columns = [f"/jointset/j{k}/q{k}/{what}" for what in ("value", "speed") for k in range(2)]
    guess = folder / "guess.sto"
    write_sto(
        guess, "", TIMES * 0.8, (*columns, *MOTORS), np.tile(0.2 * np.sin(TIMES)[:, None], (1, 6))
    )
    counts = {"states": 4, "controls": 2} | dict.fromkeys(
        ("derivatives", "input_controls", "multipliers", "parameters", "slacks"), 0
    )
    head = "\n".join(
        ["inDegrees=no", *(f"num_{name}={count}" for name, count in sorted(counts.items()))]
    )
    guess.write_text(
        f"{head}\nDataType=double\nversion=3\nendheader{guess.read_text().partition('endheader')[2]}"
    )
    osimlite.write(study.problem.phases.model.model, folder / "model.osim")
    study.problem.phases.model = osimlite.ModelProcessor(name="model", filepath="model.osim")
    study.solver.optim_max_iterations = 1
    osimlite.write(study, folder / "study.omoco")
    # Remove the tab at the end of each row, which readers do not need.
    markers = folder / "markers.trc"
    markers.write_text("".join(line.rstrip() + "\n" for line in markers.read_text().splitlines()))
    used = {file.name: file.read_text() for file in sorted(folder.iterdir())}
    text = used["study.omoco"]
    needed = [name for name in used if f">{name}<" in text or name in ("model.osim", "study.omoco")]
    needed += ["loads.sto"] if "loads.xml" in needed else []
    return Project({name: used[name] for name in sorted(needed)})


Kind = Callable[[Project, random.Random], Change | None]


def _swap(pattern: str, *news: str | Callable[[re.Match[str]], str], sure: bool = True) -> Kind:
    """Return a fault that replaces the first group of a pattern by another text.

    Args:
        pattern: regular expression with one group.
        news: replacements, or functions that compute one from the match.
        sure: whether the fault must be reported.
    """

    def change(project: Project, draw: random.Random) -> Change | None:
        text = project.texts["study.omoco"]
        found = [*re.finditer(pattern, text, re.DOTALL)]
        if not found:
            return None
        match, new = draw.choice(found), draw.choice(news)
        new = new if isinstance(new, str) else new(match)
        start, end = match.span(1)
        line = text.count("\n", 0, start) + 1
        what = f"line {line}: {match[1]!r} -> {new!r}"
        return Change("study.omoco", what, text[:start] + new + text[end:], (line,), (), sure)

    change.__name__ = pattern
    return change


def path_misspelt(project: Project, draw: random.Random) -> Change | None:
    def new(match: re.Match[str]) -> str:
        return match[1][:1] + misspelt(draw, match[1][1:])

    return _swap(r"[>\"\s](/[a-z0-9_/|]{3,})[<\"\s]", new)(project, draw)


KINDS: tuple[Kind, ...] = (
    path_misspelt,
    path_misspelt,
    _swap(r"<bounds>(-?[\d.]+ -?[\d.]+)<", lambda match: " ".join(match[1].split()[::-1]), "1 2 3", "NaN 1", "a b"),
    _swap(r"<initial_bounds>([^<]*)<", "7", "1 -1", "nan", "x"),
    _swap(r"<weight>([^<]*)<", "heavy", "1,5", "", "0x10"),
    _swap(r"<num_mesh_intervals>([^<]*)<", "-4", "0", "2.5", "many", "1e30"),
    _swap(r"<mesh>([^<]*)<", "0 0.7 0.4 1", "0 1 2", "0.1 1", "0 0 1", "0 nan 1", "1"),
    _swap(r"<transcription_scheme>([^<]*)<", "euler", "legendre-gauss-0", "legendre-gauss-12", "Trapezoidal", ""),
    _swap(r"<multibody_dynamics_mode>([^<]*)<", "semi-explicit", ""),
    _swap(r"<optim_hessian_approximation>([^<]*)<", "bfgs"),
    _swap(r"<optim_solver>([^<]*)<", "snopt", "fmincon"),
    _swap(r"<optim_convergence_tolerance>([^<]*)<", "-3", "0", "tight", "nan"),
    _swap(r"<optim_max_iterations>([^<]*)<", "-7", "1.5"),
    _swap(r"<(Moco\w+Goal|Moco\w+Constraint) name", "MocoEnergyGoal", "MocoControlGaol"),
    _swap(r"<(MocoCasADiSolver)", "MocoTropterSolver", "MocoSolver"),
    _swap(r"<filepath>(model.osim)<", "", "modle.osim", "motion.sto", "../model.osim"),
    _swap(r"<guess_file>([^<]*)<", "motion.sto", "gues.sto", "model.osim"),
    _swap(r"<exponent>([^<]*)<", "0", "-1", "1.5"),
    _swap(r"<output_index>([^<]*)<", "3", "-2", "x"),
    _swap(r"<property_name>([^<]*)<", "masss", "inertia", "mass_center"),
    _swap(r"<pattern>([^<]*)<", ".*(", "nothing"),
    _swap(r"<mode>([^<]*)<", "costs", "endpoint"),
    _swap(r"<loads_frame>([^<]*)<", "middle"),
    _swap(r"<projection_vector>([^<]*)<", "0 0 0", "1 2"),
    _swap(r"<projection>([^<]*)<", "line"),
    _swap(r"<reaction_measures>([^<]*)<", "force-w", "force"),
    _swap(r"<external_force_name>([^<]*)<", "food", ""),
    _swap(r"<frame_paths>([^<]*)<", ""),
    _swap(r"<joint_path>([^<]*)<", "", "/bodyset/b1"),
    _swap(r"<state_paths>([^<]*)<", "/jointset/j9/q9/value"),
    _swap(r"<minimum_distance>([^<]*)<", "-1", "5"),
    _swap(r"(<MocoFinalBounds.*?</MocoFinalBounds>)", '<MocoFinalBounds name="time_final_bounds"><bounds>5 9</bounds>'
          "</MocoFinalBounds>", '<MocoFinalBounds name="time_final_bounds"><bounds>-2 -1</bounds></MocoFinalBounds>'),
    _swap(r"(<lower_bound>.*?</lower_bound>)", ""),
)  # fmt: skip
"""Faults that a study can have."""


def faults(project: Project, draw: random.Random) -> Iterator[tuple[str, Change]]:
    """Yield random faults without end, 60 % of them specific to studies."""
    while True:
        kind = draw.choice(KINDS if draw.random() < 0.6 else GENERAL)
        change = kind(project, draw)
        if change is not None and change.text != project.texts[change.file]:
            yield kind.__name__, change
