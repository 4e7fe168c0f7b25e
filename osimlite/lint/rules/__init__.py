"""The rules, a module for each subject; :mod:`osimlite.lint.registry` lists them."""
