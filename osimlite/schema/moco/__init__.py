"""Documents of Moco: optimal control problems, their goals and their solvers."""
