"""``python/<package>/``: messages, enumerations, flags, stages, and the protocol that ties them together."""

from stagewire_generator.targets.python.render import render

__all__ = ["render"]
