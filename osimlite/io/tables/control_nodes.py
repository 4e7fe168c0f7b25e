"""Tables of controls as documents of ControlSets, which controllers and old tools of OpenSim read."""

from __future__ import annotations

from collections.abc import Iterator
from xml.sax.saxutils import quoteattr

import numpy as np

from osimlite.io.tables.storage import StoTable

_START = """<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="40600">
	<ControlSet name="Control Set">
		<objects>
"""
_BEFORE = """			<ControlLinear name={name}>
				<is_model_control>true</is_model_control>
				<extrapolate>true</extrapolate>
				<default_min>0.02</default_min>
				<default_max>1</default_max>
				<filter_on>false</filter_on>
				<use_steps>false</use_steps>
				<x_nodes>
"""
_NODE = """					<ControlLinearNode>
						<t>%.17g</t>
						<value>%.17g</value>
					</ControlLinearNode>
"""
_AFTER = """				</x_nodes>
				<min_nodes />
				<max_nodes />
				<kp>100</kp>
				<kv>20</kv>
			</ControlLinear>
"""
_END = """		</objects>
		<groups />
	</ControlSet>
</OpenSimDocument>
"""


def control_set(table: StoTable) -> Iterator[str]:
    """The text of a ControlSet, in parts: a ControlLinear for each column; what is no number has no node."""
    yield _START
    for name, values in zip(table.columns, table.rows.T, strict=True):
        known = ~np.isnan(values)
        nodes = np.column_stack([table.times[known], values[known]])
        yield _BEFORE.format(name=quoteattr(name))
        yield _NODE * len(nodes) % tuple(nodes.ravel().tolist())
        yield _AFTER
    yield _END
