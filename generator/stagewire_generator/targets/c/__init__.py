"""``c/<package>/``: types and accessors in headers, one per chapter, for hosts and controllers."""

from stagewire_generator.targets.c.view import render, render_tests

__all__ = ["render", "render_tests"]
