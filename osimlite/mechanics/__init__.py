"""The mechanics of a model: force laws, compiled arithmetic, the mechanism, and translation to C++ and JavaScript."""
