"""``python/<package>/``: messages, enumerations, flags, stages, and the protocol object."""

from stagewire_generator.targets.python.view import render

__all__ = ["render"]
