"""OSIM843 and OSIM849: measured loads, their columns and where they act."""

from __future__ import annotations

from osimlite.lint.engine import ERROR, INFO, WARNING, Found, rule
from osimlite.lint.setup import Setup
from osimlite.lint.words import called, nearest_name
from osimlite.text import listed


@rule("OSIM843", "load-columns", severity=ERROR, mends="both", about="document")
def load_columns(setup: Setup, found: Found) -> None:
    """The columns of a measured force are not in the data.

    ## What it does
    Looks for the columns whose labels begin with the identifiers of an external force: there must be three of each.
    Points out a force without a point (it acts at the origin of the body), columns that are not in the order x, y, z
    (OpenSim takes them in the order of the file), and forces without an identifier.

    ## Why is this bad
    OpenSim refuses loads of which it does not find three columns, and swaps the axes of those in another order without
    a word.

    ## Example
    ```setup
    <OpenSimDocument Version="40600">
        <ExternalLoads name="loads">
            <objects>
                <ExternalForce name="right">
                    <applied_to_body>shank</applied_to_body>
                    <force_identifier>ground_force_v</force_identifier>
                    <point_identifier>ground_force_q</point_identifier>
                </ExternalForce>
            </objects>
            <datafile>leg_grf.mot</datafile>
        </ExternalLoads>
    </OpenSimDocument>
    ```

    ## Use instead
    ```setup
    <OpenSimDocument Version="40600">
        <ExternalLoads name="loads">
            <objects>
                <ExternalForce name="right">
                    <applied_to_body>shank</applied_to_body>
                    <force_identifier>ground_force_v</force_identifier>
                    <point_identifier>ground_force_p</point_identifier>
                </ExternalForce>
            </objects>
            <datafile>leg_grf.mot</datafile>
        </ExternalLoads>
    </OpenSimDocument>
    ```
    """
    for loads in setup.named("ExternalLoads"):
        table = setup.table(loads.datafile)
        if table is None or not table.labels:
            continue
        columns = table.columns
        prefixes = sorted({column[:-1] for column in columns if column[-1:] in "xyzXYZ"})
        names = [force.name for force in loads.objects]
        for place, force in enumerate(loads.objects):
            if force.name in names[:place]:
                found(f"a force is called '{force.name}' already", force, attribute="name", severity=WARNING)
            if not str(force.applied_to_body):
                found(f"{called(force)} acts on no body: OpenSim refuses it", force, tag="applied_to_body")
            if not force.appliesForce:
                found(f"{called(force)} does not act", force, tag="appliesForce", severity=INFO)
                continue
            if not force.force_identifier and (force.point_identifier or not force.torque_identifier):
                found(f"{called(force)} names no columns of a force: OpenSim refuses it", force, tag="force_identifier")
            elif force.force_identifier and not force.point_identifier:
                found(
                    f"{called(force)} has no point: OpenSim lets it act at the origin of {force.applied_to_body}",
                    force, tag="point_identifier", severity=WARNING,
                )  # fmt: skip
            for tag in ("force_identifier", "point_identifier", "torque_identifier"):
                prefix = getattr(force, tag)
                if not prefix:
                    continue
                own = [column for column in columns if column.startswith(prefix)]
                if len(own) != 3 or len(set(own)) != 3:
                    what = listed(own) if own else "none"
                    found(
                        f"'{loads.datafile}' must have three columns that begin with '{prefix}' ({tag} of "
                        f"{called(force)}), it has {what}: OpenSim refuses the loads",
                        force, tag=tag, suggestion=None if len(own) > 3 else nearest_name(prefix, prefixes),
                    )  # fmt: skip
                elif [column[-1:].lower() for column in own] != ["x", "y", "z"] and {
                    column[-1:].lower() for column in own
                } == {"x", "y", "z"}:
                    found(
                        f"'{loads.datafile}' has {listed(own)} in this order: OpenSim takes the first for x",
                        force, tag=tag, severity=WARNING,
                    )  # fmt: skip
