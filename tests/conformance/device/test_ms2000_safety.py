"""The suite does no harm to an MS-2000, even if some of its bytes are lost."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st
from ms2000_runs import (
    CHANGING,
    MOVING,
    NOTHING,
    WIDE,
    controller_of,
    declared_with,
    found,
    run_suite,
    state_of,
    stepped,
)
from watched_links import DeadLink, WatchedLink

from stagewire.errors import TransportLostError
from stagewire.framing import CommandReceived
from stagewire_conformance.device.checks.ms2000.harmless import harmless_bytes, harmless_value
from stagewire_conformance.device.errors import NotAllowedError, NothingAnswersError
from stagewire_conformance.device.lines.command_line import CommandLine
from stagewire_conformance.device.permissions import Need, Permissions, Range
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.results import Result
from stagewire_conformance.device.run import RunInterrupted, run
from stagewire_conformance.registry import registry_of
from stagewire_ms2000 import PROTOCOL
from stagewire_ms2000 import messages as m

X = 0x18
SETTINGS = Permissions(settings=True)
MILLIMETRE = Permissions(settings=True, motion=Range.parse("0..1mm"))
IN_COMMANDS = {"power_on_mode": "low"}


def line_of(allowed: Permissions) -> CommandLine:
    controller = controller_of(strategies=IN_COMMANDS)
    return CommandLine(WatchedLink(stepped(controller)), declared_with(), allowed)


def writes(line: CommandLine) -> list[bytes]:
    return [entry.raw for entry in line.log if entry.sent]


# The guard


@pytest.mark.parametrize(
    ("command", "allowed"),
    [
        (m.WriteTargetPosition(5), NOTHING),
        (m.WriteTargetPosition(5), SETTINGS),
        (m.WriteTargetPosition(10_001), MILLIMETRE),
        (m.WriteTargetPosition(-1), MILLIMETRE),
        (m.IncrementMoveUp(), SETTINGS),
        (m.WriteVectorSpeed(1), SETTINGS),
        (m.StartMotor(), SETTINGS),
        (m.WriteTopSpeed(5), NOTHING),
        (m.WriteTopSpeed(5), Permissions(motion=MILLIMETRE.motion)),
        (m.JoystickEnable(), NOTHING),
        (m.WriteStartSpeed(1), WIDE),
        (m.ReadStartSpeed(), WIDE),
        (m.WriteIncrementValue(0x52FF), WIDE),
        (m.WriteIncrementValue(0x41FF), WIDE),
        (m.WriteIncrementValue(0x48FF00), WIDE),
    ],
    ids=str,
)
def test_a_forbidden_command_is_not_sent(command: object, allowed: Permissions) -> None:
    line = line_of(allowed)
    with pytest.raises(NotAllowedError, match=command.layout.message):
        line.send(command, X)
    assert writes(line) == []


def test_a_command_to_an_undeclared_axis_is_not_sent() -> None:
    line = line_of(WIDE)
    with pytest.raises(NotAllowedError, match="axis 26 is not declared"):
        line.send(m.WriteTargetPosition(5), 0x1A)
    assert writes(line) == []


@pytest.mark.parametrize(
    ("command", "allowed"),
    [
        (m.ReadStatus(), NOTHING),
        (m.StopMotor(), NOTHING),
        (m.WriteTopSpeed(5), SETTINGS),
        (m.WriteTargetPosition(10_000), MILLIMETRE),
        (m.WriteIncrementValue(0x42FF), SETTINGS),  # 255 66 changes nothing
        (m.SwitchToLowLevel(), NOTHING),
        (m.SwitchToHighLevel(), SETTINGS),
    ],
    ids=str,
)
def test_an_allowed_command_is_sent(command: object, allowed: Permissions) -> None:
    line = line_of(allowed)
    line.send(command, None if command.layout.kind == "setup" else X)
    assert len(writes(line)) == 1


@pytest.mark.parametrize("command", [m.SwitchToHighLevel(), m.ResetController()], ids=str)
def test_leaving_the_format_needs_settings_and_a_reset_is_never_sent(command: object) -> None:
    for allowed in (NOTHING, WIDE) if isinstance(command, m.ResetController) else (NOTHING,):
        with pytest.raises(NotAllowedError):
            line_of(allowed).send(command)


@pytest.mark.parametrize(
    "raw",
    [
        b"\x18T\x03\xa0\x86\x01:",
        b"\x18T\x03\xa0\x86",  # what follows would be data
        b"T",
        b"\x18a\x03\x18+\x00:",
        b"\x18B:",
        b"\x18\x00+:",
        b"\xff",  # what follows could be a letter
        b"\x01\xffR",
        b"\xffr:",
        b"\xffh:",
        b"\x18a\x03:\r",
        b"\n",
    ],
    ids=lambda raw: raw.hex(),
)
@pytest.mark.parametrize("allowed", [NOTHING, WIDE], ids=["none", "all"])
def test_bytes_that_could_move_or_stop_an_axis_are_not_sent(
    raw: bytes, allowed: Permissions
) -> None:
    line = line_of(allowed)
    with pytest.raises(NotAllowedError):
        line.send_bytes(raw)
    assert writes(line) == []
    with pytest.raises(NotAllowedError):
        line.send(m.ReadStatus(), X, sized=True, extra=raw.replace(b":", b""))
    assert writes(line) == []


def test_bytes_that_could_change_a_setting_need_permission() -> None:
    raw = b"\x18D\x02\x01\x01:"
    with pytest.raises(NotAllowedError, match="WRITE_INCREMENT_VALUE"):
        line_of(NOTHING).send_bytes(raw)
    line_of(SETTINGS).send_bytes(raw)


def test_only_requests_follow_an_incomplete_command_until_a_colon() -> None:
    line = line_of(WIDE)
    line.send_bytes(b"\x18a\x03", "a request without its colon")
    for command in (m.WriteTargetPosition(5), m.WriteTopSpeed(5), m.SwitchToHighLevel()):
        with pytest.raises(NotAllowedError, match="not a complete command"):
            line.send(command, None if command.layout.kind == "setup" else X)
    line.ask(m.ReadStatus(), X)
    line.settle()
    line.send(m.WriteTargetPosition(5), X)
    assert writes(line)[-1] == m.WriteTargetPosition(5).pack(X)


# Lost bytes


def sent_by_a_run(allowed: Permissions, seed: int) -> list[bytes]:
    controller = controller_of(strategies=IN_COMMANDS)
    link = WatchedLink(stepped(controller))
    run_suite(link, allowed=allowed, seed=seed)
    return link.writes


def damaged(writes: Sequence[bytes]) -> Iterator[bytes]:
    """Yield the stream with bytes lost at the beginning, at the end or inside of one write.

    Long garbage is left out, because the guard ensures that it contains no command byte.
    """
    for at, raw in enumerate(writes):
        if len(raw) > 16:
            continue
        behind = b"".join(writes[at + 1 : at + 4])
        for cut in range(1, len(raw) + 1):
            yield raw[cut:] + behind
            yield raw[:-cut] + behind
            yield raw[: cut - 1] + raw[cut:] + behind


def effects_of(stream: bytes) -> set[str]:
    """Return the effects of all commands that a controller may find in a stream, however it reads it."""
    entries = registry_of(PROTOCOL).messages
    by_colon = [part + b":" for part in stream.split(b":")]  # any colon ends a command
    parts = [(PROTOCOL.framer(), stream), *((PROTOCOL.framer(), part) for part in by_colon)]
    return {
        entries[event.frame.message.layout.message]["effect"]
        for framer, part in parts
        for event in framer.feed(part)
        if isinstance(event, CommandReceived)
    }


@pytest.mark.parametrize(
    ("allowed", "opened"),
    [(NOTHING, {"none", "connection"}), (SETTINGS, {"none", "connection", "settings"})],
    ids=["none", "settings"],
)
def test_lost_bytes_never_cause_a_forbidden_effect(allowed: Permissions, opened: set[str]) -> None:
    writes = {raw: None for seed in range(4) for raw in sent_by_a_run(allowed, seed)}
    looked = 0
    for stream in damaged([*writes]):
        looked += 1
        assert effects_of(stream) <= opened, stream.hex(" ")
    assert looked > 2000


def test_a_move_inside_a_damaged_value_would_be_found() -> None:
    """Show that the previous test can fail, with a carelessly chosen value."""
    careless = (
        m.WriteIncrementValue(0x035418).pack(X),
        m.ReadStatus().pack(X),
        m.ReadStatus().pack(X),
    )
    assert any("motion" in effects_of(stream) for stream in damaged(careless))


@given(st.integers(), st.integers(-(1 << 23), (1 << 23) - 1), st.integers(0, 5000))
def test_random_values_contain_no_command_byte(seed: int, low: int, width: int) -> None:
    high = min(low + width, (1 << 23) - 1)
    value = harmless_value(random.Random(seed), low, high, 3)
    assert low <= value <= high
    acting = {*PROTOCOL.rule.requests, 0x3A, 0xFF}
    tops = {top.to_bytes(2, "little", signed=True) for top in range(low >> 8, (high >> 8) + 1)}
    free = [top for top in tops if acting.isdisjoint(top)]
    if high - low < 512 or len(free) < len(tops) // 2:
        return  # there may be few harmless values, or none
    assert acting.isdisjoint((value % (1 << 24)).to_bytes(3, "little"))


@given(st.integers(), st.integers(0, 300))
def test_random_bytes_are_never_commands(seed: int, count: int) -> None:
    drawn = harmless_bytes(random.Random(seed), count)
    assert len(drawn) == count
    assert all(byte < 0x20 or byte >= 0x80 for byte in drawn)  # commands are printable
    assert not {0xFF, 0x0A, 0x0D, 0x11, 0x13, 0x18, 0x19, 0x1A, 0x1B} & set(drawn)


# Interruptions


class Failing(WatchedLink):
    """A line that ends a run at one of its reads."""

    def fail_at(self, number: int, how: type[BaseException]) -> None:
        self.writes_before = 0

        def fail() -> None:
            if self.reads == number:
                self.writes_before = len(self.writes)
                raise how("it happens")

        self.before_read = fail


def reads_of(only: list[str]) -> int:
    link = WatchedLink(stepped(controller_of(strategies=IN_COMMANDS)))
    run_suite(link, only=only)
    return link.reads


@pytest.mark.parametrize("only", [[kind] for kind in CHANGING + MOVING], ids=lambda only: only[0])
def test_an_interrupted_run_stops_first_and_restores_settings_without_moving(
    only: list[str],
) -> None:
    declared = declared_with()
    checks = plan(declared, WIDE, only=only)
    total = reads_of(only)
    for number in range(60, total, max(1, total // 12)):
        controller = controller_of(strategies=IN_COMMANDS)
        before = state_of(controller)
        link = Failing(stepped(controller))
        link.fail_at(number, KeyboardInterrupt)
        with pytest.raises(RunInterrupted):
            run(link, checks, declared, WIDE, 1)
        behind = link.writes[link.writes_before :]
        moved = {raw for raw in behind if len(raw) > 1 and raw[1] in b"T+-^G"}
        assert not moved, (number, moved)
        controller.advance(5)
        for name, axis in state_of(controller).items():
            settings = ("increment", "ramp_time", "top_speed", "joystick")
            assert [axis[key] for key in settings] == [before[name][key] for key in settings], (
                number
            )
            assert axis["does"] in ("idle", "stopped"), number


def test_a_stop_is_sent_twice_after_a_colon_if_a_command_may_be_incomplete() -> None:
    """If a move lost a byte, the first stop becomes part of it."""
    line = line_of(WIDE)
    line.send(m.WriteTargetPosition(5), X)
    line.send_bytes(b"\x18a\x03", "a request without its colon")
    line.halt()
    assert writes(line)[2:] == [b":", b"\x18B:", b"\x18B:"]


def test_an_axis_that_reports_rest_is_also_stopped() -> None:
    """Its status may be wrong."""
    line = line_of(WIDE)
    line.send(m.WriteTargetPosition(5), X)
    line.moving.discard(X)
    assert line.rest()
    assert b"\x18B:" not in writes(line)
    line.halt()
    assert writes(line)[-2:] == [b"\x18B:", b"\x18B:"]


def test_an_axis_moved_by_an_earlier_check_is_not_stopped() -> None:
    line = line_of(WIDE)
    line.send(m.WriteTargetPosition(5), X)
    line.forget()
    line.halt()
    assert len(writes(line)) == 1


def test_a_line_lost_during_a_move_ends_the_run_with_a_reason() -> None:
    declared = declared_with()
    controller = controller_of(strategies=IN_COMMANDS)
    link = Failing(stepped(controller))
    link.fail_at(150, TransportLostError)
    report = run(link, plan(declared, WIDE, only=["move-target"]), declared, WIDE, 1)
    assert "the line was lost" in report.unfinished
    assert b"\x18B:" in link.writes[link.writes_before :]


# First contact


def test_a_dead_port_is_reported_within_seconds_after_two_requests_in_each_format() -> None:
    link = DeadLink()
    declared = declared_with()
    with pytest.raises(NothingAnswersError, match="its switches set this baud rate"):
        run(link, plan(declared, NOTHING), declared, NOTHING, 1)
    assert link.now < 4


def test_an_error_message_of_the_other_format_is_not_a_contact() -> None:
    class Text(WatchedLink):
        """A controller in the other format that answers lines and colons with an error."""

        low_level = False

        def write(self, data: bytes) -> None:
            super().write(data)
            self.low_level |= data == b"\xffB"
            self.low_level &= data != b"\xffA"
            if not self.low_level:
                self.said = b":N-1\r\n"

        def read(self, timeout: float) -> bytes:
            said, self.said = getattr(self, "said", b""), b""
            return said or super().read(timeout)

    link = Text(stepped(controller_of()))
    report = run_suite(link, allowed=NOTHING, only=["identification", "reads"])
    assert found(report, Result.FAIL) == []
    assert report.identification == {"identification": "EMOT"}
    assert link.writes[-1] == b"\xffA"  # left as it was found


def test_a_controller_without_identification_is_accepted() -> None:
    class Nameless(WatchedLink):
        def write(self, data: bytes) -> None:
            if data[1:2] != b"i":
                super().write(data)

    report = run_suite(Nameless(stepped(controller_of())), allowed=NOTHING, only=["reads"])
    assert report.identification == {}
    assert found(report, Result.FAIL) == []


def test_every_check_that_needs_a_permission_describes_its_actions() -> None:
    for check in plan(declared_with(travel="-10..10mm"), WIDE):
        assert bool(check.needs) == bool(check.does), check.id
        if Need.MOTION in check.needs:
            assert "-20..20mm" in check.does
