"""A controller that has lost step is brought back: the link is drained, and opened again if it can be."""

from __future__ import annotations

import socket

import pytest
from apt_runs import bench, run_on
from faulty_apt_link import FaultyAptLink, LinkFault

from stagewire.errors import LinkOpenError, TransportLostError
from stagewire.links import Link
from stagewire_apt import messages as m
from stagewire_conformance.device.lines import reopening
from stagewire_conformance.device.lines.apt_line import AptLine
from stagewire_conformance.device.lines.reopening import Reopenable, ReopeningLink
from stagewire_conformance.device.results import Result
from wrapped_links import WrappedLink

BOTH = ("truncated/header", "readback/0x50/MOT_SET_VELPARAMS/1")


class Locked(FaultyAptLink):
    """A line to a controller that ignores everything after an incomplete header."""

    def __init__(self, link: Link) -> None:
        super().__init__(link, LinkFault())
        self.locked = False

    def write(self, data: bytes) -> None:
        self.locked = self.locked or 1 < len(data) < 6
        if not self.locked:
            super().write(data)


class Unlocked(Locked, Reopenable):
    """The same line, on which the controller begins anew with each connection."""

    opened = 1

    def reopen(self) -> bool:
        self.opened += 1
        self.locked = False
        return True


def test_a_reopened_line_lets_the_next_checks_run() -> None:
    on = bench("TDC001")
    link = Unlocked(on.link)
    report = run_on(on, BOTH, link=link)
    results = {outcome.check.id: outcome.result for outcome in report.outcomes}
    assert results.pop("truncated/header") is Result.FRAGILE
    assert set(results.values()) == {Result.PASS}
    assert link.opened > 1
    texts = [finding.text for outcome in report.outcomes for finding in outcome.findings]
    assert any("only after the connection was opened again" in text for text in texts)


def test_a_line_that_cannot_be_reopened_leaves_the_next_checks_undecided() -> None:
    on = bench("TDC001")
    report = run_on(on, BOTH, link=Locked(on.link))
    results = {outcome.check.id: outcome.result for outcome in report.outcomes}
    assert results.pop("truncated/header") is Result.FRAGILE
    assert set(results.values()) == {Result.NOT_RUN}


def test_a_line_is_not_reopened_while_something_may_be_moving() -> None:
    on = bench("TDC001")
    link = Unlocked(on.link)
    line = AptLine(link, on.declared, on.allowed())
    line.send(m.MotMoveHome(1), 0x50)
    assert not line.reopen()
    assert line.rest()
    assert line.reopen()
    assert link.opened == 2


class Closable(WrappedLink):
    """A link that remembers that it was closed."""

    def __init__(self, link: Link) -> None:
        super().__init__(link)
        self.url = "/dev/port"
        self.closed = False

    def close(self) -> None:
        self.closed = True


def test_a_link_is_closed_before_it_is_opened_again() -> None:
    made: list[Closable] = []

    def opened() -> Link:
        assert all(each.closed for each in made)
        made.append(Closable(bench("TDC001").link))
        return made[-1]

    link = ReopeningLink("/dev/port", opened)
    assert link.reopen()
    assert [each.closed for each in made] == [True, False]


def test_a_port_that_is_gone_is_a_lost_line(monkeypatch: pytest.MonkeyPatch) -> None:
    pauses: list[float] = []
    monkeypatch.setattr(reopening.time, "sleep", pauses.append)
    made = [Closable(bench("TDC001").link)]

    def opened() -> Link:
        if not made:
            raise LinkOpenError("it is gone")
        return made.pop()

    link = ReopeningLink("/dev/port", opened)
    with pytest.raises(TransportLostError, match="could not be opened again: it is gone"):
        link.reopen()
    assert len(pauses) == 4


def test_a_virtual_controller_is_not_restarted() -> None:
    with ReopeningLink("virtual://TDC001") as link:
        assert not link.reopen()


def test_a_network_connection_is_opened_again() -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        ReopeningLink(f"socket://127.0.0.1:{server.getsockname()[1]}") as link,
    ):
        first, _ = server.accept()
        assert link.reopen()
        second, _ = server.accept()
        with first, second:
            assert first.recv(1) == b""
            link.write(b"again")
            assert second.recv(5) == b"again"
