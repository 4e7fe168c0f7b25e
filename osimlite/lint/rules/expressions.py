"""OSIM606: formulas of forces and functions."""

from __future__ import annotations

from collections.abc import Iterator

from osimlite.errors import ModelError
from osimlite.lint.registry import ERROR, FAILS, REFUSES, WARNING, FindingCollector, rule
from osimlite.lint.rules.functions import UNUSED, is_unused
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object
from osimlite.schema.base import Object
from osimlite.schema.forces import Force

_BUSHING_VARIABLES = ("theta_x", "theta_y", "theta_z", "delta_x", "delta_y", "delta_z")
_BUSHING_PROPERTIES = tuple(
    f"{letter}{axis}_expression" for letter in ("M", "F") for axis in ("x", "y", "z")
)

FORMULAS = {
    "ExpressionBasedCoordinateForce": (("expression",), ("q", "qdot")),
    "ExpressionBasedPointToPointForce": (("expression",), ("d", "ddot")),
    "ExpressionBasedPathForce": (("expression",), ("s", "ldot")),
    "ExpressionBasedBushingForce": (_BUSHING_PROPERTIES, _BUSHING_VARIABLES),
}
"""Properties that are formulas, with the variables that they may name, by class."""


@rule("OSIM606", "broken-expression", severity=ERROR, consequences=(REFUSES, FAILS))
def report_broken_expression(subject: Subject, report: FindingCollector) -> None:
    """The formula of a force or a function cannot be read.

    Reports expressions with a syntax error, and those that name an unknown variable or function.

    OpenSim rejects the model if a formula has a syntax error. With an unknown variable, OpenSim
    fails at the first acceleration. OpenSim does not compute the formulas of a disabled force or
    controller, and the finding is a warning. But it rejects a syntax error in a formula of a force
    even then.
    Formulas support + - * / ^, functions such as sin, sqrt, exp, min, step, and definitions after a
    semicolon as in `k*q; k=100`. There is no pi and no `**`. OpenSim first simplifies a formula:
    `0*x` becomes 0, even if the variable x is unknown.

    ```xml
      <ExpressionBasedCoordinateForce name="spring">
          <coordinate>knee_angle</coordinate>
    -     <expression>-20*q - 0.5*qd</expression>
    +     <expression>-20*q - 0.5*qdot</expression>
      </ExpressionBasedCoordinateForce>
    ```
    """
    for item, tag, variables in _find_formulas(subject):
        # Few models have formulas, and reading them takes the kernels.
        from osimlite.mechanics.multibody.formula import Formula, UnknownVariableError

        text = getattr(item, tag)
        try:
            Formula.parse(text, variables, "it")
        except ModelError as error:
            reason = error.message.removeprefix(f"it is '{text}': ")
            formula_text = f"'{text}'" if text else "empty"
            # OpenSim reads the formula of a force that is off, and does not compute it.
            is_read = isinstance(item, Force) and not isinstance(error, UnknownVariableError)
            is_off = is_unused(subject, item) and not is_read
            report(
                f"{tag} of "
                f"{subject.describe_part(item) if not item.name else describe_object(item)} is "
                f"{formula_text}: {UNUSED if is_off else 'OpenSim cannot compute it'}; {reason}",
                item,
                tag=tag,
                consequence=FAILS
                if isinstance(error, UnknownVariableError)
                else REFUSES
                if isinstance(item, Force)
                else None,
                severity=WARNING if is_off else None,
            )


def _find_formulas(subject: Subject) -> Iterator[tuple[Object, str, tuple[str, ...]]]:
    """Yield each formula of a model: the object, the property, the variables."""
    for name, (tags, variables) in FORMULAS.items():
        for force in subject.find_by_class(name):
            for tag in tags:
                yield force, tag, variables
    for function in subject.find_by_class("ExpressionBasedFunction"):
        yield function, "expression", tuple(function.variables)
