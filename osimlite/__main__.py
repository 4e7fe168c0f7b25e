"""``python -m osimlite`` is the command ``osimlite``."""

from osimlite.cli import main

main()
