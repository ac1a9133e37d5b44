"""``c/<package>/``: types and accessors in headers, one a chapter, for both ends of the line."""

from stagewire_generator.targets.c.view import render, render_tests

__all__ = ["render", "render_tests"]
