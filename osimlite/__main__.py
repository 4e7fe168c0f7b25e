"""``python -m osimlite`` is the command ``osimlite``."""

import os
import sys

# With -m Python looks for modules in the current folder first, which may be a stranger's: a
# `numpy.py` there would be run. The command of the name `osimlite` does not look there either.
if (
    not sys.flags.safe_path
    and sys.path
    and not os.path.isdir(os.path.join(sys.path[0], "osimlite"))
):
    del sys.path[0]

from osimlite.cli import main

main()
