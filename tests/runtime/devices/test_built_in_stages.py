"""A stage that is built into a unit is the default of ``stage=``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire import Scale, Stage
from stagewire.errors import UnknownScaleError
from stagewire_apt import TDC001

OTHER = Stage.of_user("OTHER", position=Scale.counts_per("mm", 2000))


@pytest.fixture(autouse=True)
def built_in() -> Iterator[None]:
    """Build a stage into the TDC001."""
    object.__setattr__(TDC001.unit, "built_in", "Z806")
    yield
    object.__setattr__(TDC001.unit, "built_in", None)


def counts_of_a_mm(**options: Any) -> int:
    with TDC001.open(RecordingLink(virtual.TDC001()), **options) as device:
        device.set_pos_counter(mm=1)
        counts: int = device.get_pos_counter().position
        return counts


def test_the_built_in_stage_is_used_unless_another_is_named() -> None:
    assert counts_of_a_mm() == 34304
    assert counts_of_a_mm(stage=OTHER) == 2000


def test_a_unit_without_a_built_in_stage_needs_its_name() -> None:
    object.__setattr__(TDC001.unit, "built_in", None)
    with pytest.raises(UnknownScaleError):
        counts_of_a_mm()
