"""``c/<package>/``: types and accessors in headers, one a chapter, for both ends of the line."""

from stagewire_generator.targets.c.render import render

__all__ = ["render"]
