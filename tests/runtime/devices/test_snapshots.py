"""Snapshots of the settings of a channel, and writing them back."""

from __future__ import annotations

import asyncio
import json
import logging
import struct
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire._devices.reals import pattern_of
from stagewire.errors import BadValueError, LimitError, UnsupportedError
from stagewire_apt import KDC101, TDC001, TPA101, TPZ001, aio, devices, stages
from stagewire_apt import messages as m
from stagewire_apt.devices.facts import FACTS, UNITS
from stagewire_apt.messages import PROTOCOL
from stagewire_ms2000 import MS2000
from stagewire_virtual.factory import simulated_units

UNITS_ALONE = [
    name for name, unit in UNITS.items() if unit.kind != "bay" and name in simulated_units()
]
REGISTRY = {entry["name"]: entry for entry in PROTOCOL.registry()["messages"]}
ALLOWED = {"none", "settings"}
"""Effects of the messages that a snapshot and its restoration may send."""


def kdc101() -> RecordingLink:
    return RecordingLink(virtual.KDC101(stage=stages.Z825B))


def channel_of(device: Any) -> Any:
    part = device.bay(1) if device.unit.kind == "rack" else device
    return part.channel(1) if hasattr(part, "channel") else part


def writable(unit: str) -> set[str]:
    """Return the sets of the registry that a unit can report and write, except counters."""
    listed = UNITS[unit].messages
    sets: dict[str, set[str]] = {}
    for name, entry in REGISTRY.items():
        if name in listed and entry["set"] and entry.get("tells") != "counter":
            sets.setdefault(entry["set"]["name"], set()).add(entry["set"]["role"])
    return {name for name, roles in sets.items() if roles == {"set", "req", "get"}}


@pytest.mark.parametrize("unit", UNITS_ALONE)
def test_a_snapshot_has_every_set_and_restoring_it_writes_nothing(unit: str) -> None:
    line = RecordingLink(getattr(virtual, unit)())
    with getattr(devices, unit).open(line) as device:
        part = channel_of(device)
        taken = part.snapshot()
        names = {
            table.name
            for message, table in FACTS.writers().items()
            if REGISTRY[message]["set"]["name"] in writable(unit)
            and not table.asked
            and not table.motherboard
        }
        assert taken["settings"].keys() == names
        assert taken["unit"] == unit
        line.forget()
        stored = json.loads(json.dumps(taken))
        assert part.restore(stored, tuning=True) == ()
        assert {REGISTRY[name]["effect"] for name in line.names(PROTOCOL)} <= {"none"}


def test_only_the_values_that_differ_are_written() -> None:
    line = kdc101()
    with KDC101.open(line) as kdc:
        taken = kdc.snapshot()
        kdc.change_vel_params(max_velocity_mm_per_s=1)
        kdc.change_jog_params(step_size_mm=0.5)
        line.forget()
        assert kdc.restore(taken) == ("vel_params", "jog_params")
        sent = line.names(PROTOCOL)
        assert {name for name in sent if REGISTRY[name]["effect"] != "none"} == {
            "MOT_SET_VELPARAMS", "MOT_SET_JOGPARAMS",
        }  # fmt: skip
        assert kdc.snapshot() == taken


def test_control_loops_are_restored_only_when_asked_for() -> None:
    with KDC101.open(kdc101()) as kdc:
        taken = kdc.snapshot()
        kdc.change_dc_pid_params(proportional=7)
        assert kdc.restore(taken) == ()
        assert kdc.get_dc_pid_params().proportional == 7
        assert kdc.restore(taken, tuning=True) == ("dc_pid_params",)
        assert kdc.snapshot() == taken


def test_nothing_moves_and_no_output_changes() -> None:
    line = RecordingLink(virtual.TPZ001())
    with TPZ001.open(line) as piezo:
        taken = piezo.snapshot()
        for held in taken["settings"].values():
            for name, value in held.items():
                held[name] = value + 1 if isinstance(value, int) and value < 2 else value
        line.forget()
        piezo.restore(taken)
        assert {REGISTRY[name]["effect"] for name in line.names(PROTOCOL)} <= ALLOWED
    with KDC101.open(kdc101()) as kdc:
        taken = kdc.snapshot()
        kdc.disable()
        kdc.restore(taken, tuning=True)
        assert not kdc.is_enabled()


def test_a_set_without_an_answer_is_left_out_with_a_warning(
    caplog: pytest.LogCaptureFixture,
) -> None:
    line = kdc101()
    with KDC101.open(line) as kdc:
        line.twist = lambda data: b"" if data[:2] == b"\x15\x04" else data  # MOT_GET_VELPARAMS
        with caplog.at_level(logging.WARNING, "stagewire"):
            settings = kdc.snapshot(timeout=0.1)["settings"]
        assert "vel_params" not in settings
        assert "jog_params" in settings
        assert "not in the snapshot: vel_params" in caplog.text


WRONG = [
    ({}, "this is not a snapshot"),
    (3, "this is not a snapshot"),
    ({"unit": "BSC101", "settings": {}}, "the snapshot is of a BSC101, not of a KDC101"),
    ({"unit": "KDC101", "settings": {"x": {}}}, "unknown settings x"),
    ({"unit": "KDC101", "settings": {"vel_params": 3}}, "vel_params must be a mapping"),
    ({"unit": "KDC101", "settings": {"vel_params": {"y": 1}}}, "vel_params has no y"),
]


@pytest.mark.parametrize(("given", "text"), WRONG)
def test_anything_else_is_refused_before_anything_is_written(given: Any, text: str) -> None:
    line = kdc101()
    with KDC101.open(line) as kdc:
        line.forget()
        with pytest.raises(BadValueError, match=text):
            kdc.restore(given)
        assert {REGISTRY[name]["effect"] for name in line.names(PROTOCOL)} <= {"none"}


def test_all_values_are_checked_before_the_first_is_written() -> None:
    line = kdc101()
    with KDC101.open(line) as kdc:
        taken = kdc.snapshot()
        taken["settings"]["vel_params"]["max_velocity"] += 1
        taken["settings"]["jog_params"]["jog_max_velocity"] = 10**9
        line.forget()
        with pytest.raises(LimitError, match="restore: jog_params: jog_max_velocity"):
            kdc.restore(taken)
        assert {REGISTRY[name]["effect"] for name in line.names(PROTOCOL)} <= {"none"}


def test_the_snapshot_of_asyncio_is_that_of_threads() -> None:
    async def take() -> dict[str, Any]:
        async with aio.TDC001.open("virtual://TDC001") as tdc:
            taken = await tdc.snapshot()
            assert await tdc.restore(taken) == ()
            return taken

    with TDC001.open("virtual://TDC001") as tdc:
        assert tdc.snapshot() == asyncio.run(take())


def test_a_unit_without_settings_says_so() -> None:
    refused = pytest.raises(UnsupportedError, match="no settings of MS2000 that can be read")
    with MS2000.open("virtual://MS2000") as ms2000, ms2000.low_level(), refused:
        ms2000.axis("X").snapshot()


def loop_params(gain: float) -> bytes:
    reals = ("pid_consts_p", "pid_consts_i", "pid_consts_d", "pid_consts_dfc", "filter_fc")
    numbers = dict.fromkeys(reals, pattern_of(gain, 4))
    return m.QuadGetLoopParams2(
        **numbers, filter_q=pattern_of(1.0, 4), notch_filter_on=1, pid_deriv_filter_on=1
    ).pack(0x01, 0x50)


class LoopLink(RecordingLink):
    """A line to a detector that only answers the request for its second set of loop constants."""

    held = loop_params(5.5)

    def __init__(self) -> None:
        super().__init__(virtual.TPZ001())
        self._waiting = b""

    def read(self, timeout: float) -> bytes:
        said, self._waiting = self._waiting, b""
        return said or super().read(timeout)

    def write(self, data: bytes) -> None:
        if m.QuadReqLoopParams2().pack(0x50, 0x01) in data:
            self._waiting += self.held
        super().write(data)


def test_real_numbers_of_a_snapshot_are_numbers_and_can_be_restored() -> None:
    line = LoopLink()
    with TPA101.open(line, identify=False, timeout=0.05) as detector:
        taken = detector.snapshot()
        assert taken["settings"]["loop_params_2"]["pid_consts_p"] == 5.5
        line.held = loop_params(7.0)
        only = {**taken, "settings": {"loop_params_2": taken["settings"]["loop_params_2"]}}
        assert detector.restore(only, tuning=True) == ("loop_params_2",)
        assert struct.pack("<f", 5.5) in line.raw
