"""Run JavaScript kernels by Node.js."""

from __future__ import annotations

import json
import math
import shutil
import subprocess

import pytest

from tests.mechanics.codegen.compiled import SIZE

NODE = shutil.which("node")
needs_node = pytest.mark.skipif(NODE is None, reason="needs Node.js on the PATH")

PROGRAM = """\
const kernels = %s;
const numbers = (texts) => texts.map(Number);
const results = %s.map(([name, ints, floats, count]) => {
  const vectors = [numbers(ints), numbers(floats), Array(%d).fill(0)].map((items) => Float64Array.from(items));
  const value = Number(kernels[name](...vectors, count));
  return [String(value), ...vectors.map((vector) => [...vector].map((x) => Object.is(x, -0) ? "-0" : String(x)))];
});
console.log(JSON.stringify(results));
"""


def call_javascript(text, calls):
    """Call JavaScript kernels with integers, floats, a vector of results and a count.

    Args:
        text: JavaScript text of an object that contains the kernels by name.
        calls: name, integers, floats and count of each call.

    Returns:
        For each call, the return value and the three vectors afterwards.
    """
    given = [
        [name, list(map(_write, ints)), list(map(_write, floats)), count]
        for name, ints, floats, count in calls
    ]
    program = PROGRAM % (text, json.dumps(given), SIZE)
    result = subprocess.run([NODE, "-"], input=program, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr[-3000:]
    return [
        [
            int(float(value)),
            [int(float(x)) for x in ints],
            *([float(x) for x in row] for row in rows),
        ]
        for value, ints, *rows in json.loads(result.stdout, parse_constant=float)
    ]


def _write(number):
    if math.isnan(number):
        return "NaN"
    return repr(number) if math.isfinite(number) else f"{'-' * (number < 0)}Infinity"
