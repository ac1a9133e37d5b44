"""What is made from the model: one package a target, each with a ``render`` function."""
