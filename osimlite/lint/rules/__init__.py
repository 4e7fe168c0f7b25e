"""Rules, one module for each subject; :mod:`osimlite.lint.registry` lists the modules."""
