"""The units of each issue of the APT document in the installed package.

Tests that follow Issue 3 in every detail cover the units of Issue 3. The tests of Issue 37
(``tests/generator/test_issue_37*.py``, ``test_virtual_overlays.py``) and the conformance suite cover the
others.
"""

from __future__ import annotations

from stagewire_apt import PROTOCOL

_RESTATED = {"BSC101", "BBD202", "BBD203"}
"""Units of Issue 3 that Issue 37 describes again."""

_UNITS = {unit["name"]: unit.get("overlay", "") for unit in PROTOCOL.registry()["units"]}

OF_ISSUE_3 = frozenset(name for name, overlay in _UNITS.items() if not overlay or name in _RESTATED)
OF_ISSUE_37 = frozenset(_UNITS) - OF_ISSUE_3
