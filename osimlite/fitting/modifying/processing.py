"""A ModelProcessor carried out: its model is read, and its operators are applied one after the other."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from osimlite.errors import ModelError, UnsupportedError
from osimlite.fitting.modifying.operators import OPERATIONS
from osimlite.io.document.kept import read_anew
from osimlite.schema.model import Model
from osimlite.schema.tools.processors import ModelOperator, ModelProcessor


def processed(processor: ModelProcessor, folder: str | Path = ".") -> Model:
    """The model of a processor, changed as that says.

    Args:
        processor: of a study or a tool; its `filepath` is looked for from the folder.
        folder: of its document.

    Raises:
        DocumentError: a file is missing or holds something else.
        ModelError: it has no model, or an operator names what is not there.
        UnsupportedError: an operator cannot be applied.
    """
    name = processor.filepath.strip()
    if name:
        model = read_anew(Path(folder) / name, Model)
    elif processor.model is not None:
        model = processor.model.copy_deep()
    else:
        raise ModelError("a ModelProcessor has neither a filepath nor a model; give it one")
    apply(model, processor.operators, folder)
    return model


def apply(model: Model, operators: Iterable[ModelOperator], folder: str | Path = ".") -> None:
    """Change a model as operators say, in their order; errors as of :func:`processed`."""
    for operator in operators:
        operation = OPERATIONS.get(type(operator))
        if operation is None:
            name = getattr(operator, "class_name", "") or type(operator).__name__
            known = ", ".join(cls.__name__ for cls in OPERATIONS)
            raise UnsupportedError(f"a {name} cannot be applied; there are {known}")
        operation(model, operator, Path(folder))
