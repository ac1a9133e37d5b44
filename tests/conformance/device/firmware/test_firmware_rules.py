"""Defects of firmware break rules of checks, and a finding names each."""

from __future__ import annotations

import pytest
from firmware_bench import bench
from firmware_commands import FaultyCommandLink
from firmware_corpus import COMMANDS, DEFECTS
from firmware_line import FaultyLink
from test_firmware_faults import kinds_of

from parts import every_nth
from planted_faults import cases_of, rules_named
from stagewire.links import Link

OF_FRAMES = {defect.name: defect for defect in DEFECTS}
OF_COMMANDS = {defect.name: defect for defect in COMMANDS}


@pytest.mark.parametrize(("rule", "name"), every_nth(cases_of("firmware"), 11))
def test_a_planted_defect_breaks_the_rule(rule: str, name: str) -> None:
    link: Link
    if name in OF_FRAMES:
        drawn = OF_FRAMES[name].draw(0)
        unit = bench(drawn.unit)
        link = FaultyLink(unit.line(0), drawn.firmware, unit.status)
        kinds = kinds_of(OF_FRAMES[name], whole=False)
    else:
        where, firmware, _ = OF_COMMANDS[name].draw(0)
        unit = bench(where)
        link = FaultyCommandLink(unit.line(0), firmware)
        kinds = kinds_of(OF_COMMANDS[name], whole=False)
    assert rule in rules_named(unit.run(link, kinds, 0))
