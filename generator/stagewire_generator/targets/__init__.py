"""The targets of generation: one package per target, each with a ``render`` function."""
