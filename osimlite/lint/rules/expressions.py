"""OSIM606: formulas of forces and functions."""

from __future__ import annotations

from collections.abc import Iterator

from osimlite.errors import ModelError
from osimlite.lint.engine import ERROR, FindingSink, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import called
from osimlite.schema.base import Object

_BUSHING_VARIABLES = ("theta_x", "theta_y", "theta_z", "delta_x", "delta_y", "delta_z")
_BUSHING_PROPERTIES = tuple(f"{letter}{axis}_expression" for letter in ("M", "F") for axis in ("x", "y", "z"))

FORMULAS = {
    "ExpressionBasedCoordinateForce": (("expression",), ("q", "qdot")),
    "ExpressionBasedPointToPointForce": (("expression",), ("d", "ddot")),
    "ExpressionBasedPathForce": (("expression",), ("s", "ldot")),
    "ExpressionBasedBushingForce": (_BUSHING_PROPERTIES, _BUSHING_VARIABLES),
}
"""The properties of each class that are formulas, and the variables that these may name."""


@rule("OSIM606", "broken-expression", severity=ERROR)
def broken_expression(subject: Subject, report: FindingSink) -> None:
    """The formula of a force or a function cannot be read.

    Reports expressions that are no formula, and those that name a variable or a function that there
    is not.

    OpenSim refuses the model where the formula is wrong, and fails at the first acceleration where
    a variable is unknown. Formulas know + - * / ^, functions such as sin, sqrt, exp, min, step, and
    after a semicolon definitions as in `k*q; k=100`. There is no pi and no `**`.

    ```xml
      <ExpressionBasedCoordinateForce name="spring">
          <coordinate>knee_angle</coordinate>
    -     <expression>-20*q - 0.5*qd</expression>
    +     <expression>-20*q - 0.5*qdot</expression>
      </ExpressionBasedCoordinateForce>
    ```
    """
    for item, tag, variables in _formulas(subject):
        # Few models have formulas, and reading them takes the kernels.
        from osimlite.multibody.formula import Formula

        text = getattr(item, tag)
        try:
            Formula.parse(text, variables, "it")
        except ModelError as error:
            reason = error.message.removeprefix(f"it is '{text}': ")
            shown = f"'{text}'" if text else "empty"
            report(
                f"{tag} of {subject.called_with(item) if not item.name else called(item)} is "
                f"{shown}: {reason}; OpenSim cannot compute it",
                item,
                tag=tag,
            )


def _formulas(subject: Subject) -> Iterator[tuple[Object, str, tuple[str, ...]]]:
    """Yield each formula of a model: the object, the property, the variables."""
    for name, (tags, variables) in FORMULAS.items():
        for force in subject.named(name):
            for tag in tags:
                yield force, tag, variables
    for function in subject.named("ExpressionBasedFunction"):
        yield function, "expression", tuple(function.variables)
