"""The first contact with an MS-2000: other controllers are recognised. Also the texts of a log."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest
from faulty_ms2000_link import answers
from ms2000_runs import NOTHING, WIDE, controller_of, declared_with, run_suite, stepped
from watched_links import DeadLink, WatchedLink

from stagewire.links import Link
from stagewire_apt import messages as apt
from stagewire_conformance.device.errors import NothingAnswersError
from stagewire_conformance.device.lines.command_line import CommandLine
from stagewire_conformance.device.pics_draft import ask_pics
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.run import run
from stagewire_ms2000 import messages as m

X, Y = 0x18, 0x19
SAYS = "bytes arrived that are not a reply. Check the baud rate and the kind of controller"
FRAME = apt.MotMoveCompletedHeader(1).pack(0x01, 0x50)

_DRAWN = random.Random(1)


class Talker(DeadLink):
    """A line with something else at the other end. It answers or sends on its own."""

    def __init__(
        self, answer: Callable[[bytes], bytes], flood: bytes = b"", seconds: float = 0.01
    ) -> None:
        super().__init__()
        self._answer = answer
        self._flood = flood
        self._seconds = seconds
        self._due = 0.0

    def write(self, data: bytes) -> None:
        self._says += self._answer(data)

    def read(self, timeout: float) -> bytes:
        if self._flood:
            if self.now + timeout < self._due:
                self.now += timeout
                return b""
            self.now = max(self.now, self._due)
            self._due = self.now + self._seconds
            return self._flood
        if self._says:
            self.now += min(timeout, 0.001)
            said, self._says = self._says, b""
            return said
        return super().read(timeout)


def nothing(sent: bytes) -> bytes:
    return b""


OTHERS: dict[str, Callable[[], Link]] = {
    "zeros": lambda: Talker(lambda sent: bytes(6)),
    "noise": lambda: Talker(lambda sent: _DRAWN.randbytes(6)),
    "text that is never the same": lambda: Talker(
        lambda sent: bytes(_DRAWN.choices(range(0x30, 0x7B), k=6))
    ),
    "one byte of noise": lambda: Talker(lambda sent: _DRAWN.randbytes(1)),
    "an echo": lambda: Talker(lambda sent: sent),
    "an echo said twice": lambda: Talker(lambda sent: sent * 2),
    "an error of another protocol": lambda: Talker(lambda sent: b"?\r\n"),
    "an error of the other format": lambda: Talker(lambda sent: b":N-1\r\n"),
    "a long text": lambda: Talker(lambda sent: b"Unknown command\r\n"),
    "frames of APT": lambda: Talker(lambda sent: FRAME),
    "a flood of frames": lambda: Talker(nothing, FRAME),
    "a flood of zeros": lambda: Talker(nothing, bytes(64), 0.04),
    "a flood of text": lambda: Talker(nothing, b"EFIL :"),
    "a byte now and then": lambda: Talker(nothing, b"b", 0.045),
    "a byte seldom": lambda: Talker(nothing, b"\xff", 0.2),
}


@pytest.mark.parametrize("other", OTHERS)
def test_other_controllers_are_reported_as_such(other: str) -> None:
    declared = declared_with()
    link = OTHERS[other]()
    with pytest.raises(NothingAnswersError) as caught:
        run(link, plan(declared, NOTHING), declared, NOTHING, 1)
    assert f"no MS2000 answers at {link.url}: " in str(caught.value)
    assert SAYS in str(caught.value)
    assert link.clock is not None
    assert link.clock() < 4


@pytest.mark.parametrize("other", OTHERS)
def test_no_pics_is_written_for_another_controller(other: str) -> None:
    link = OTHERS[other]()
    with pytest.raises(NothingAnswersError, match="no MS2000 answers"):
        ask_pics(link, "MS2000")
    assert link.clock is not None
    assert link.clock() < 4


@pytest.mark.parametrize(
    "says",
    [
        b"EMOT :", b"EMOT  ", b"EMOT:", b"EMOT \r", b"EMOT", b"EMOT :\r\n", b"EMOT :EMOT :", b"EMOX :",
        b"EFIL :",
    ],
)  # fmt: skip
def test_a_slightly_wrong_reply_is_left_to_the_checks(says: bytes) -> None:
    link = answers(lambda raw, _: says, m.ReadIdentification)(controller_of())
    report = run_suite(link, declared_with(axes=["X"]), NOTHING, ["identification"])
    assert report.identification == {
        "identification": says.decode("ascii").rstrip(": "),
    }
    assert len(report.outcomes) == 1


def test_an_unreadable_reply_is_left_to_the_checks_if_the_status_is_readable() -> None:
    link = answers(lambda raw, _: bytes(6), m.ReadIdentification)(controller_of())
    assert run_suite(link, None, NOTHING, ["identification"]).identification == {}


# The texts of a log


def test_a_log_names_commands_and_axes_as_the_document_does() -> None:
    line = CommandLine(WatchedLink(stepped(controller_of())), declared_with(), WIDE)
    line.send(m.SwitchToLowLevel())
    line.send(m.WriteTargetPosition(5), X)
    line.ask(m.ReadIdentification(), Y)
    line.ask(m.ReadStatus(), 0x1A, sized=True, extra=b"\x01")
    line.halt()
    assert [(entry.sent, entry.text) for entry in line.log] == [
        (True, "SWITCH_TO_LOW_LEVEL"),
        (True, "WRITE_TARGET_POSITION of axis X target_position=5"),
        (True, "READ_IDENTIFICATION of axis Y"),
        (False, "READ_IDENTIFICATION identification='EMOT :'"),
        (True, "READ_STATUS of axis 0x1a extra=01 with a size slot"),
        (False, "READ_STATUS status=98"),
        (True, "ends an incomplete command"),
        (True, "STOP_MOTOR of axis X"),
        (True, "STOP_MOTOR of axis X"),
    ]
