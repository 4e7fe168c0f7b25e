"""What each class of controllers does, in the module of its name: `drives(builder, controller)` yields it."""
