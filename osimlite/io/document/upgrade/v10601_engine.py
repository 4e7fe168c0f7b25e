"""To 10601: the dynamics engine between the model and its parts goes, and actuators become forces."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, Refused, elements, step


@step(below=10901, order=10601)
def engine(draft: Draft) -> None:
    """The parts inside <DynamicsEngine> are the model's own.

    Only SIMBODY's engine describes a multibody system in words that later formats share.
    """
    model = draft.model
    if model is None:
        return
    for holder in model.findall("DynamicsEngine"):
        for inner in elements(holder):
            if inner.tag != "SimbodyEngine":
                lost = (
                    ", ".join(sorted({f"<{part.tag}>" for part in elements(inner)}))
                    or "its content"
                )
                raise Refused(
                    f"document version {draft.version} describes its bodies for a <{inner.tag}>, which no later format "
                    f"can say: {lost} would be lost; export the model for Simbody with the program that wrote it",
                    draft.numbers[inner],
                )
            for part in elements(inner):
                draft.move(part, model)
        draft.changed(model, at=holder)
        draft.remove(holder)
