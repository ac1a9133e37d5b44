"""Paths of the checkout."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[2]
TESTS = ROOT / "tests"
SCHEMAS = ROOT / "spec" / "schema"
SMALL_SPECS = TESTS / "generator"
"""The folder with ``good_spec``, ``good_commands``, ``good_packets`` and other small specs for tests."""
