"""``python/<package>/``: messages, enumerations, flags, stages, and the protocol that ties them together."""

from stagewire_generator.targets.python.view import render

__all__ = ["render"]
