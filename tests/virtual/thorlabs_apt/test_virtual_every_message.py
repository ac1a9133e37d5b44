"""Every message to every unit: the answers and their times must be those of the registry's exchanges."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest
import registry_oracle as oracle
from registry_oracle import (
    CHANNEL,
    CHOICES,
    MESSAGES,
    UNITS,
    Json,
    Place,
    Reply,
    forms,
    places,
    takes,
)

import stagewire_virtual as virtual
from stagewire.protocols import load_protocol

BOTH = 3
A_WHILE = 2.0
LONGEST = 3600.0
"""Longer than a move across the whole travel at the speed of any new controller."""
SUSPEND = "MOT_SUSPEND_ENDOFMOVEMSGS"
DISTANCES = ("relative_distance", "absolute_distance")
PERIODIC = "HW_START_UPDATEMSGS"
LATER = ("completes_with", "stops_with", "starts", "stops")

# Messages that some SETs require first, with the pages.
FIRST = {
    "PZ_OUTPUTPOS": [("PZ_SET_POSCONTROLMODE", {"mode": 2})],  # page 97: only in closed loop
    "PZ_OUTPUTVOLTS": [("PZ_SET_POSCONTROLMODE", {"mode": 1})],  # page 96: only in open loop
}
# Fields that a REQ does not return as they were set.
NOT_GIVEN_BACK = {
    "PZ_OUTPUTMAXVOLTS": {"flags"},  # page 121: not relevant to the SET
}
OF_THE_STAGE = {
    "MOT_PMDSTAGEAXISPARAMS"
}  # page 75: cannot be altered; the travel can be made smaller
# Values to use where the pages allow less than the ranges of the registry.
NARROWER: dict[str, dict[str, dict[str, int]]] = {
    # pages 106 and 109: limits of the TPZ001; page 110: an output trigger must start within the cycle
    "PZ_OUTPUTLUT": {"highest": {"index": 512}, "between": {"index": 300}},
    "PZ_OUTPUTLUTPARAMS": {
        "highest": {"mode": 0xFFFB, "cycle_length": 512, "trig_repeat_cycle": 512},
        "between": {"mode": 1, "cycle_length": 300, "trig_repeat_cycle": 100},
    },
    "PZ_OUTPUTMAXVOLTS": {"lowest": {"voltage": 750}, "between": {"voltage": 1000}},  # page 122
    "RACK_DIGOUTPUTS": {"highest": {"dig_op": 0b1111}, "between": {"dig_op": 0b0101}},  # page 26
}
FACTORIES = {name: getattr(virtual, name) for name in UNITS}


class Bench:
    """A new unit, and functions that send messages to it and return its answers."""

    def __init__(self, name: str, **options: Any) -> None:
        self.unit = UNITS[name]
        if name != "TSC001":  # a solenoid has no travel
            options["travel"] = 1_000_000 if is_motor(name) else 200
        self.controller = FACTORIES[name](**options)

    def send(self, name: str, form: str, given: dict[str, Any], place: Place) -> list[Reply]:
        """Send a message; return the immediate answers."""
        layout = next(layout for layout in MESSAGES[name]["layouts"] if layout["form"] == form)
        self.controller.write(oracle.pack(MESSAGES[name], layout, given, place.address))
        return self.heard()

    def heard(self) -> list[Reply]:
        """Return the replies since the last call."""
        return oracle.cut(self.controller.read(), self.unit["status"])

    def wait(self, seconds: float) -> list[Reply]:
        """Advance the clock; return the replies."""
        self.controller.advance(seconds)
        return self.heard()


def is_motor(name: str) -> bool:
    return UNITS[name]["status"] != "piezo"


def cases(name: str, choice: str) -> Iterator[tuple[Place, Json, Json, dict[str, Any], list[int]]]:
    """Yield every message in every form, to every address and channel, with the channels it addresses."""
    for place in places(UNITS[name]):
        for message in MESSAGES.values():
            for layout in forms(message):
                has_channel = any(field["name"] == CHANNEL for field in oracle.fields(layout))
                channels = place.channels or (1,)
                for channel in channels if has_channel else channels[:1]:
                    given = oracle.values(layout, choice, channel, name)
                    yield place, message, layout, given, [channel]
                if has_channel and len(channels) > 1:
                    yield (
                        place,
                        message,
                        layout,
                        oracle.values(layout, choice, BOTH, name),
                        list(channels),
                    )


def moves(name: str) -> Iterator[tuple[Place, Json, Json, dict[str, Any], list[int]]]:
    """Yield the messages that start a move, like :func:`cases`; moves with a distance are short."""
    for place, message, layout, given, channels in cases(name, "lowest"):
        begins = message["exchange"].get("completes_with") and message["exchange"].get("stops_with")
        if begins and takes(UNITS[name], place, message):
            for key in DISTANCES:
                if key in given:
                    given[key] = 4321
            yield place, message, layout, given, channels


def expect_replies(found: list[Reply], names: list[str], place: Place, channels: list[int]) -> None:
    """Check that each channel answers once, in order, from the requested address to the host."""
    with_channel = [
        n for n in names if any(has_channel(layout) for layout in MESSAGES[n]["layouts"])
    ]
    each = channels if with_channel == names else channels[:1]
    assert [reply.name for reply in found] == names * len(each)
    for reply, channel in zip(found, [c for c in each for _ in names], strict=True):
        assert (reply.dest, reply.source) == (oracle.HOST, place.address), reply
        assert reply.values.get(CHANNEL, channel) == channel, reply


def has_channel(layout: Json) -> bool:
    return any(field["name"] == CHANNEL for field in oracle.fields(layout))


@pytest.mark.parametrize("name", sorted(UNITS))
class TestEveryMessage:
    def test_only_requests_are_answered(self, name: str) -> None:
        for choice in CHOICES:
            bench = Bench(name)
            for place, message, layout, given, channels in cases(name, choice):
                if any(message["exchange"].get(key) for key in LATER):
                    continue
                found = bench.send(message["name"], layout["form"], given, place)
                taken = takes(bench.unit, place, message)
                expected = oracle.answers(bench.unit, message) if taken else []
                about = f"{message['name']} {given} to {place}, {choice}"
                try:
                    expect_replies(found, expected, place, channels)
                except AssertionError as error:
                    raise AssertionError(f"{about}: {found}") from error
            assert bench.wait(A_WHILE) == []

    def test_moves_end_with_one_message(self, name: str) -> None:
        for place, message, layout, given, channels in moves(name):
            bench = Bench(name)
            found = bench.send(message["name"], layout["form"], given, place)
            if (
                any(key in given for key in DISTANCES) and name != "TSC001"
            ):  # a solenoid completes immediately
                assert found == []
            found += bench.wait(LONGEST)
            ends = [n for n in message["exchange"]["completes_with"] if n in bench.unit["messages"]]
            about = f"{message['name']} {given} to {place}: {found}"
            assert Counter(reply.name for reply in found) == Counter(ends * len(channels)), about
            assert {reply.source for reply in found} <= {place.address}, about
            assert sorted(reply.values[CHANNEL] for reply in found) == channels * len(ends), about

    def test_suspended_moves_end_in_silence(self, name: str) -> None:
        for place, message, layout, given, _ in moves(name):
            if SUSPEND not in UNITS[name]["messages"]:
                continue
            assert SUSPEND in message["exchange"]["muted_by"]
            bench = Bench(name)
            assert bench.send(SUSPEND, "header", {}, place) == []
            assert bench.send(message["name"], layout["form"], given, place) == []
            assert bench.wait(LONGEST) == []

    def test_updates_are_sent_from_start_to_stop(self, name: str) -> None:
        starts = set(MESSAGES[PERIODIC]["exchange"]["starts"]) & set(UNITS[name]["messages"])
        period = MESSAGES[PERIODIC]["exchange"]["periodic_ms"] / 1000
        for place in places(UNITS[name]):
            if not place.channels:
                continue
            bench = Bench(name)
            assert len(starts) == 1
            assert bench.send(PERIODIC, "header", {"update_rate": 0}, place) == []
            assert bench.wait(period - 0.001) == []
            for _ in range(3):
                found = bench.wait(period)
                expect_replies(found, [*starts], place, list(place.channels))
            assert bench.send("HW_STOP_UPDATEMSGS", "header", {}, place) == []
            assert bench.wait(A_WHILE) == []

    def test_updates_stop_without_a_keep_alive(self, name: str) -> None:
        keep_alive = UNITS[name]["keep_alive"]
        place = list(places(UNITS[name]))[-1]
        for line in ("usb", "rs232"):
            bench = Bench(name, line=line)
            bench.send(PERIODIC, "header", {"update_rate": 0}, place)
            found = bench.wait(10.05)
            wanted = 50 if keep_alive != "none" and line == "usb" else 100 * len(place.channels)
            assert abs(len(found) - wanted) < len(place.channels), line
            assert bench.wait(A_WHILE) == [] or wanted != 50
            if keep_alive != "none":
                assert bench.send(keep_alive, "header", {}, place) == []
                assert bench.wait(0.2), line

    def test_a_req_returns_the_values_of_the_set(self, name: str) -> None:
        for set_name, members in oracle.APT["sets"].items():
            if not {"set", "req", "get"} <= members.keys() or set_name in OF_THE_STAGE:
                continue
            taking = [
                p for p in places(UNITS[name]) if takes(UNITS[name], p, MESSAGES[members["set"]])
            ]
            for place in taking[:1] + taking[1:][-1:]:
                bench = Bench(name)
                for choice in CHOICES:
                    for channel in place.channels or (1,):
                        self.give_back(bench, set_name, place, choice, channel)

    def give_back(
        self, bench: Bench, set_name: str, place: Place, choice: str, channel: int
    ) -> None:
        members = oracle.APT["sets"][set_name]
        for before, given in FIRST.get(set_name, ()):
            (form,) = forms(MESSAGES[before])
            bench.send(before, form["form"], {CHANNEL: channel, **given}, place)
        (layout,) = forms(MESSAGES[members["set"]])
        given = oracle.values(layout, choice, channel, bench.unit["name"])
        given.update(NARROWER.get(set_name, {}).get(choice, {}))
        bench.send(members["set"], layout["form"], given, place)
        if set_name.startswith("PZ_OUTPUT"):
            bench.wait(A_WHILE)  # until the output has followed
        (asking,) = forms(MESSAGES[members["req"]])
        asked = oracle.values(asking, "lowest", channel)
        (reply,) = bench.send(members["req"], asking["form"], asked, place)
        left_out = NOT_GIVEN_BACK.get(set_name, set())
        expected = {k: v for k, v in given.items() if k not in left_out}
        found = {k: v for k, v in reply.values.items() if k not in left_out}
        assert found == expected, f"{set_name} to {place}, {choice}"

    def test_unsupported_messages_are_answered_if_that_option_is_set(self, name: str) -> None:
        bench = Bench(name, answer_unsupported=True)
        for place, message, layout, given, _ in cases(name, "lowest"):
            if message["name"] in bench.unit["messages"] or message["direction"] == "to_host":
                continue
            if bench.unit["address"] == "bay" and place.kind == "motherboard":
                continue  # the document does not list the messages of a modular rack's motherboard
            found = bench.send(message["name"], layout["form"], given, place)
            assert [reply.name for reply in found] == ["HW_RESPONSE"], (
                f"{message['name']} to {place}"
            )
            assert (found[0].dest, found[0].source) == (oracle.HOST, place.address)

    def test_unknown_channels_and_addresses_get_no_answer(self, name: str) -> None:
        bench = Bench(name)
        there = {place.address for place in places(bench.unit)}
        for place, message, layout, given, _ in cases(name, "lowest"):
            if CHANNEL in given and place.kind != "motherboard":
                both = {BOTH} if len(place.channels) > 1 else set()
                only = {0} if len(place.channels) == 1 else set()
                for channel in {0, 1, 2, 3, 4} - {*place.channels} - both - only:
                    wrong = {**given, CHANNEL: channel}
                    assert bench.send(message["name"], layout["form"], wrong, place) == []
        for address in {0x00, 0x01, 0x11, 0x21, 0x24, 0x2A, 0x50, 0x51, 0x7F} - there:
            for message in MESSAGES.values():
                for layout in forms(message):
                    elsewhere = Place(address, "nowhere", ())
                    given = oracle.values(layout, "lowest", 1)
                    assert bench.send(message["name"], layout["form"], given, elsewhere) == []
        assert bench.wait(A_WHILE) == []


# The fields of SETs with a range or a complete list; one step outside must be refused.
RANGED = sorted({
    (message["name"], field["name"])
    for message in MESSAGES.values() if message["set"] and message["set"]["role"] == "set"
    for layout in forms(message)
    for field in oracle.fields(layout) if field["name"] != CHANNEL and field["kind"] == "integer"
    for bits in [8 * field["size"]]
    if field["maximum"] not in ((1 << bits) - 1, (1 << bits - 1) - 1, None)
    and MESSAGES[message["name"]]["set"]["name"] in oracle.APT["sets"]
    and any(message["name"] in unit["messages"] for unit in UNITS.values())
})  # fmt: skip


@pytest.mark.parametrize("answered", [False, True])
@pytest.mark.parametrize(("message", "field"), RANGED)
def test_a_value_out_of_range_changes_nothing(message: str, field: str, answered: bool) -> None:
    members = oracle.APT["sets"][MESSAGES[message]["set"]["name"]]
    name = next(n for n, unit in sorted(UNITS.items()) if message in unit["messages"])
    bench = Bench(name, answer_unsupported=answered)
    place = next(p for p in places(bench.unit) if takes(bench.unit, p, MESSAGES[message]))
    (layout,) = forms(MESSAGES[message])
    (facts,) = (f for f in oracle.fields(layout) if f["name"] == field)
    _, highest = oracle.limits(facts, name)
    assert highest is not None
    given = {**oracle.values(layout, "lowest", 1, name), field: highest + 1}

    def asked() -> list[Reply]:
        if "req" not in members:
            return []
        (asking,) = forms(MESSAGES[members["req"]])
        return bench.send(members["req"], asking["form"], oracle.values(asking, "lowest", 1), place)

    before = asked()
    refused = [reply.name for reply in bench.send(message, layout["form"], given, place)]
    assert refused == (["HW_RESPONSE"] if answered else [])
    assert asked() == before


# MS-2000 and MFC-2000: nothing is sent unsolicited, and a reply has the length in the registry.

COMMANDS: Json = load_protocol("asi_ms2000").registry()
LOW_LEVEL = b"\xff\x42"
AXES = {"X": 24, "Y": 25, "Z": 26}
GIVEN_BACK = {
    "WRITE_MOTOR_POSITION": "READ_MOTOR_POSITION",
    "WRITE_TARGET_POSITION": "READ_TARGET_POSITION",
    "WRITE_INCREMENT_VALUE": "READ_INCREMENT_VALUE",
    "WRITE_RAMPING_TIME": "READ_RAMP_TIME",
    "WRITE_TOP_SPEED": "READ_MAXIMUM_SPEED",
}


def command(entry: Json, choice: str, axis: int) -> tuple[bytes, int]:
    """Return the bytes of a command, and the length of its reply."""
    request = next(layout for layout in entry["layouts"] if layout["form"] == "request")
    reply = next((layout for layout in entry["layouts"] if layout["form"] == "reply"), None)
    given = oracle.values(request, choice, axis)
    data = b"".join(
        int(given[field["name"]]).to_bytes(field["size"], "little", signed=field["signed"])
        for field in oracle.fields(request)
    )
    size = b"" if entry["size"] is None else bytes([entry["size"]])
    return bytes((axis, entry["id"])) + size + data + b":", reply["length"] if reply else 0


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("name", [unit["name"] for unit in COMMANDS["units"]])
class TestEveryCommand:
    def test_only_reads_are_answered(self, name: str, axis: str) -> None:
        controller = getattr(virtual, name)()
        controller.write(LOW_LEVEL)
        commands = {m["name"]: m for m in COMMANDS["messages"] if m["kind"] == "command"}
        for choice in CHOICES:
            for entry in commands.values():
                sent, size = command(entry, choice, AXES[axis])
                controller.write(sent)
                found = controller.read()
                assert len(found) == size, f"{entry['name']} {sent.hex(' ')}: {found.hex(' ')}"
                if entry["name"] in GIVEN_BACK:
                    asked, size = command(commands[GIVEN_BACK[entry["name"]]], choice, AXES[axis])
                    controller.write(asked)
                    assert controller.read() == sent[3 : 3 + size], f"{entry['name']}, {choice}"
        controller.advance(LONGEST)
        assert controller.read() == b""

    def test_setup_commands_get_no_answer(self, name: str, axis: str) -> None:
        for entry in (m for m in COMMANDS["messages"] if m["kind"] == "setup"):
            controller = getattr(virtual, name)()
            controller.write(LOW_LEVEL + b"\xff" + bytes([entry["id"]]) + LOW_LEVEL)
            controller.write(bytes((AXES[axis], 0x3F)) + b":")
            assert controller.read() == b"b", entry["name"]
