"""``osimlite modify``: replace parts of a model by smoother, stiffer or simpler ones."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from osimlite.base.text import add_article
from osimlite.cli._command import Argument, Option, command

if TYPE_CHECKING:
    from osimlite.schema.difference import Difference


@command
def modify(
    file: Annotated[
        Path,
        Argument(help="A model, or a study with a ModelProcessor.", show_default=False),
    ],
    output: Annotated[
        Path | None,
        Option(
            "-o",
            "--output",
            metavar="FILE",
            help="The changed model.",
            show_default="<name>_modified.osim",
        ),
    ] = None,
    replace: Annotated[
        list[str] | None,
        Option(
            "--replace",
            metavar="NAME=WORD",
            help="muscles=degroote|path-actuators|none, tendon=rigid|explicit|implicit, activation=none, passive=none, "
            "paths=polynomial|FILE, contact=smooth, joints=weld:NAME,NAME, reserves=FORCE[:BOUND], strength=FACTOR, "
            "width=FACTOR, external-loads=FILE. May be repeated; replacements are applied in the order in which you write them.",
        ),
    ] = None,
    source: Annotated[
        str | None,
        Option(
            "--from",
            metavar="PROGRAM",
            help="'nimble': the model was made for nimblephysics (AddBiomechanics, SKEL, BioAMASS). Rewrite it so that "
            "its bodies move in OpenSim as in nimblephysics.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Replace parts of a model as OpenSim's ModOps do: muscles, tendons, paths, contact, joints.

    With paths=polynomial every path becomes a function of the coordinates, wrapping included, and
    the largest error is reported. For a MocoStudy, MocoTrack or MocoInverse, the model is the result
    of its ModelProcessor.

    With --from nimble, joints that nimblephysics and OpenSim compute differently are rewritten, so
    that the same coordinates give the same poses. It is applied before all replacements.

    Example: osimlite modify gait.osim --replace muscles=degroote --replace tendon=rigid --replace
        paths=polynomial
    """
    from osimlite.base.files import make_folder_of
    from osimlite.base.text import format_count
    from osimlite.cli._console import add_row, create_table, print_table, say
    from osimlite.errors import DocumentError, ModelError, SettingError
    from osimlite.fitting.modifying.operators import process_model
    from osimlite.fitting.modifying.words import find_change
    from osimlite.io.document.printer import write
    from osimlite.io.document.reader import read, read_any
    from osimlite.schema.difference import find_differences
    from osimlite.schema.model import Model
    from osimlite.schema.tools.processors import ModelProcessor

    if source not in (None, "nimble"):
        raise SettingError(f"--from takes 'nimble', not '{source}'")
    changes = []
    for assignment in replace or ():
        name, equals, value = assignment.partition("=")
        if not equals:
            raise SettingError(
                f"--replace takes NAME=WORD, such as muscles=degroote; got '{assignment}'"
            )
        # All words are checked before the model is read, which can take seconds.
        changes.append((assignment, find_change(name, value)))
    top = read_any(file)
    if isinstance(top, Model):
        if not changes and source is None:
            raise SettingError(
                "there is nothing to replace; add --replace NAME=WORD, such as muscles=degroote"
            )
        model = read(file)
    else:
        processor = next(
            (member for member in top.walk() if isinstance(member, ModelProcessor)), None
        )
        if processor is None:
            raise DocumentError(
                f"{add_article(type(top).__name__)} has no model to change", file=str(file)
            )
        model = process_model(processor, file.parent)
    rewritten = []
    if source == "nimble":
        from osimlite.translate.nimble import convert_from_nimble

        rewritten = convert_from_nimble(model)
    fitted = []
    summaries = []
    for assignment, apply_change in changes:
        before = model.copy_deep()
        try:
            fitted += apply_change(model, file.parent) or []
        except ModelError as error:
            # The model lacks a part that the option names.
            raise SettingError(f"--replace {assignment}: {error.message}") from None
        summary = _summarize_differences(find_differences(before, model))
        summaries.append(f"{assignment}: {summary}")
    target = output or file.with_name(f"{file.stem}_modified.osim")
    make_folder_of(target)
    write(model, target)
    for joint_change in rewritten:
        say(
            f"{joint_change.component}: {joint_change.difference}; {joint_change.done or 'not changed'}"
        )
    if source == "nimble" and not rewritten:
        say("OpenSim moves this model as Nimble does; nothing was rewritten")
    for summary in summaries:
        say(summary)
    if fitted:
        table = create_table("Errors of the fitted polynomials")
        for heading in (
            "path",
            "coordinates",
            "order",
            "length: rms, mm",
            "moment arms: rms, mm",
            "largest error, mm",
        ):
            table.add_column(heading, justify="left" if heading == "path" else "right")
        for path_fit in sorted(fitted, key=lambda path_fit: -path_fit.worst_arm):
            numbers = (
                path_fit.length,
                path_fit.arm,
                max(path_fit.worst_length, path_fit.worst_arm),
            )
            count = len(path_fit.path.coordinate_paths)
            name = path_fit.path.name.rpartition("/")[2]
            add_row(
                table,
                name,
                str(count),
                str(path_fit.order),
                *(f"{1e3 * number:.3f}" for number in numbers),
            )
        print_table(table)
    say(f"{target}: {format_count(len(list(model.components())), 'component')}")


def _summarize_differences(differences: list[Difference]) -> str:
    """Return how many components a replacement changed, added and removed, by class."""
    from collections import Counter

    from osimlite.base.text import format_count, join_words

    added: Counter[str] = Counter()
    removed: Counter[str] = Counter()
    new_classes: Counter[tuple[str, str]] = Counter()
    changed_paths: dict[str, None] = {}
    changed_properties: dict[str, None] = {}
    replaced_paths: set[str] = set()
    for path, property_name, old, new in differences:
        if property_name == "class":
            new_classes[old, new] += 1
            replaced_paths.add(path)
        # Properties that only one of two classes has come and go with the class.
        elif property_name and path in replaced_paths and (old is None or new is None):
            continue
        elif property_name:
            changed_paths[path] = None
            changed_properties[property_name] = None
        elif old is None:
            added[new] += 1
        else:
            removed[old] += 1
    parts = [f"{count} {old} became {new}" for (old, new), count in new_classes.items()]
    if changed_paths:
        count_text = format_count(len(changed_paths), "component")
        parts.append(f"{join_words(changed_properties, max_count=3)} of {count_text} changed")
    parts += [f"{count} {name} added" for name, count in added.items()]
    parts += [f"{count} {name} removed" for name, count in removed.items()]
    return "; ".join(parts) or "nothing changed"
