"""The rules, one module per family; :mod:`osimlite.lint.registry` lists them."""
