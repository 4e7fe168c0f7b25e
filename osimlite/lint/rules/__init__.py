"""The rules, one module per family; :mod:`osimlite.lint.engine` collects them."""
