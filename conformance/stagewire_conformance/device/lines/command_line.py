"""The guarded link to a controller of commands without frames, and the first contact with one.

A reply has no frame, so that only the command gives it a meaning: a request is sent, the expected number of
bytes is awaited, and bytes that follow shortly after them belong to no reply. At first contact any byte
could be a reply. Bytes that look like one are accepted, even a wrong one: checks find out what is wrong
with it. Noise, an echo and another protocol are refused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Final

from stagewire.errors import CodecError
from stagewire.links import Link
from stagewire.protocols import Command, CommandFrame, CommandProtocol, Reply, SetupCommand
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.errors import NothingAnswersError
from stagewire_conformance.device.lines.command_guard import CommandGuard
from stagewire_conformance.device.lines.dialogue import message_text
from stagewire_conformance.device.lines.line import GuardedLink
from stagewire_conformance.device.permissions import Permissions
from stagewire_ms2000 import messages as m

_MOTOR: Final = b"EMOT"
"""What an axis says that it is (section 7)."""
_TEXT: Final = 5
"""Bytes of the text of an identification; the sixth is told in two ways."""
_MOST: Final = 12
"""Bytes of an identification that is said twice; who says more does not answer what was asked."""
_BUSY: Final = (b"B", b"b", b"N", b"n")
"""Letters of a status, and small and capital exchanged."""
_ROUND: Final = 1.0
"""Seconds in which all axes are asked one thing."""


def first_contact(line: CommandLine) -> tuple[dict[str, int | str], bool]:
    """Ask the axes what they are, and in the format of commands if none answers rightly at once.

    Returns what the first one says, nothing where one tells its status but not what it is; and whether the
    controller was found in the other format. Raises :class:`.NothingAnswersError` where no reply comes.
    """
    first = answer = _identification(line)
    found_in_text = False
    if not answer.startswith(_MOTOR):  # nothing, or an error message of the other format
        line.send(m.SwitchToLowLevel())
        answer = _identification(line)
        found_in_text = bool(answer) and answer != first
    if answer:
        return {
            "identification": answer.decode("ascii", "backslashreplace").rstrip(": ")
        }, found_in_text
    if _tells_status(line):
        return {}, False
    raise NothingAnswersError(_nothing(line))


def _identification(line: CommandLine) -> bytes:
    """Return what the first axis that says what it is says; empty where none does.

    What is no right answer has to come twice, as noise does not.
    """
    request = m.ReadIdentification()
    for axis, answer in _answers(line, request):
        if answer.startswith(_MOTOR) or (_is_text(answer) and answer == _ask(line, request, axis)):
            return answer
    return b""


def _tells_status(line: CommandLine) -> bool:
    """Return whether an axis tells its status, twice."""
    request = m.ReadStatus()
    return any(
        answer in _BUSY and _ask(line, request, axis) in _BUSY
        for axis, answer in _answers(line, request)
    )


def _answers(line: CommandLine, request: Command) -> Iterator[tuple[int, bytes]]:
    """Yield what comes from each axis, until the time is over or something talks on and on."""
    end = line.now + _ROUND
    for place in line.declared.places:
        if (left := end - line.now) <= 0:
            return
        answer = _ask(line, request, place.address, left)
        if len(answer) > _MOST:
            return
        yield place.address, answer


def _ask(line: CommandLine, request: Command, axis: int, left: float = _ROUND) -> bytes:
    return line.ask(request, axis, min(left, _ROUND / len(line.declared.places)))


def _is_text(answer: bytes) -> bool:
    """Return whether bytes could be the text of an identification, though another one."""
    text = answer[:_TEXT]
    return len(text) == _TEXT and text.isascii() and text.decode("ascii").isprintable()


def _nothing(line: CommandLine) -> str:
    name = line.declared.unit.name
    came = sum(len(entry.raw) for entry in line.log if not entry.sent)
    if came:
        return (
            f"no {name} answers at {line.url}: {came} bytes came that are no reply (another baud rate, "
            "or another kind of controller?)"
        )
    axes = ", ".join(place.name for place in line.declared.places)
    return (
        f"nothing answers at {line.url}: none of the axes {axes} says what it is, neither at once nor "
        f"after 255 66, which switches to the low-level format. Is the {name} "
        "switched on, is this its port, and is the baud rate that of its switches?"
    )


QUIET: Final = 0.05
"""Seconds of silence after which nothing more is taken to come."""

_LIMIT: Final = 1.0
"""Seconds in which a controller that talks on and on is listened to, at most."""
_SOON: Final = 0.3
"""Seconds in which a controller that is well answers a request."""
_UNASKED: Final = "nobody asked for it"


class CommandLine(GuardedLink):
    """Sends commands, and hears replies.

    Bytes that are no command leave open where a controller begins to read, and so may a command in another
    form than the document prints. After them nothing is sent but requests, until :meth:`settle` has brought
    both sides into step again.

    :param link: open; it stays so.
    :param declared: what is at its other end.
    :param allowed: what may be sent beside requests; the rest is refused, see :class:`.CommandGuard`.
    """

    def __init__(self, link: Link, declared: Declaration, allowed: Permissions) -> None:
        super().__init__(link, declared, allowed)
        protocol = declared.protocol
        assert isinstance(protocol, CommandProtocol)
        self._end = bytes((protocol.marks.terminator,))
        self._guard = CommandGuard(protocol, declared, allowed)
        self._waiting = b""  # what came and was not looked at
        self._in_step = True
        self._found_in_text = False
        self._stirred = self.now  # when something was sent or came last
        self.unasked = b""
        """What came while nothing was asked, since the line was last settled."""
        self.moving: set[int] = set()
        """Axes that may move because of what was sent; who was told that one rests takes it out."""
        # and those that say that they rest, since the line was settled
        self._moved: set[int] = set()
        self.stopped: set[int] = set()
        """Axes that were stopped, and are disabled until they are started again (section 16)."""

    # To the controller

    def send(
        self,
        command: Command | SetupCommand,
        axis: int | None = None,
        *,
        sized: bool | None = None,
        extra: bytes = b"",
    ) -> None:
        """Send a command; nothing is awaited.

        :param axis: its identifier; None for a setup command.
        :param sized: whether the size slot is there; None: as the document prints the command.
        :param extra: bytes between its data and the colon, which a controller ignores.

        Raises :class:`~stagewire_conformance.device.errors.NotAllowedError` for what was not allowed.
        """
        frame = CommandFrame(command, axis, extra, sized)
        raw = frame.encode(allow_dummy=True)  # which the guard refuses
        self._guard.check(frame, raw, self._in_step)
        if axis is not None and self._guard.moves(frame):
            self.moving.add(axis)
            self._moved.add(axis)
        if isinstance(command, m.StopMotor):
            self.stopped.add(frame.axis or 0)
        elif isinstance(command, m.StartMotor):
            self.stopped.discard(frame.axis or 0)
        if frame.extra or frame.form != "request":
            self._in_step = False  # a controller may read it otherwise than it is meant
        self._write(raw, partial(self._words, frame))
        self._stirred = self.now

    def send_bytes(self, raw: bytes, about: str = "") -> None:
        """Send bytes that may be no command at all.

        :param about: what they are, for the log.

        Raises :class:`~stagewire_conformance.device.errors.NotAllowedError` if any part of them could be a
        command that does more than was allowed.
        """
        self._guard.check_bytes(raw)
        self._in_step = False
        self._write(raw, lambda: about)
        self._stirred = self.now

    # From the controller

    def ask(
        self,
        command: Command,
        axis: int,
        wait: float = 1.0,
        *,
        sized: bool | None = None,
        extra: bytes = b"",
        quiet: float = QUIET,
    ) -> bytes:
        """Send a request and return exactly what came: the bytes that are due, and what came behind them.

        Whoever gets more or fewer bytes than the reply has, has not got the reply.

        :param wait: seconds in which the reply has to be there.
        :param quiet: seconds without a byte behind the reply that are waited for; with 0 what comes late
            is found among :attr:`unasked`.
        """
        self._fill(0)
        self.unasked += self._out(len(self._waiting), _UNASKED)
        self.send(command, axis, sized=sized, extra=extra)
        return self.hear(command, wait, quiet)

    def hear(self, command: Command, wait: float = 1.0, quiet: float = QUIET) -> bytes:
        """Return what comes as the reply to a command that was sent, and behind it, as :meth:`ask` does."""
        reply = command.reply
        assert reply is not None  # what is asked has an answer
        return self.collect(reply.layout.length, wait, quiet, lambda raw: _reply_text(raw, reply))

    def collect(
        self,
        size: int,
        wait: float = 1.0,
        quiet: float = QUIET,
        about: str | Callable[[bytes], str] = "",
    ) -> bytes:
        """Return ``size`` bytes that come within ``wait`` seconds, or fewer, and all that comes behind them.

        :param about: what they say, for the log.
        """
        end = self.now + wait
        while len(self._waiting) < size and (left := end - self.now) > 0:
            self._fill(left)
        return self._out(size, about) + self._until_quiet(quiet, "it belongs to no reply")

    def listen(self, seconds: float) -> bytes:
        """Return all that comes within some seconds."""
        end = self.now + seconds
        while (left := end - self.now) > 0:
            self._fill(left)
        return self._out(len(self._waiting), _UNASKED)

    # What a run does with it

    def contact(self) -> dict[str, int | str]:
        """Ask the axes what they are; see :meth:`.GuardedLink.contact`.

        Where none answers rightly, the controller may be in the other format. It is switched then to that of
        commands, into which there is no other way (section 1), and :meth:`leave` switches it back.
        """
        identity, self._found_in_text = first_contact(self)
        return identity

    def settle(self) -> list[str]:
        """Come into step again, and read until nothing comes any more; see :meth:`.GuardedLink.settle`.

        A colon ends what may be open. Of a command that writes it would be data, and no number of colons
        would help (``3A 3A 3A`` is a position); but bytes that could begin one are never sent but as a whole.
        A controller that does not answer then is led back into the format of commands.
        """
        if not self._in_step:
            self._write(self._end, lambda: "ends what may be open")
            self._in_step = True
            self.unasked += self._until_quiet(QUIET, _UNASKED)
            if not self.ask(m.ReadStatus(), self.declared.places[0].address, _SOON, quiet=0):
                self.send(m.SwitchToLowLevel())  # something may have led out of it
        silent = self.now - self._stirred  # often a check has waited for silence by itself
        came = self.unasked + self._until_quiet(max(0.0, QUIET - silent), _UNASKED)
        self.unasked = b""
        self._moved &= self.moving
        return [f"{came.hex(' ')}: {_UNASKED}"] if came else []

    def halt(self) -> None:
        """Stop every axis that was set in motion, also if it reports rest; see :meth:`.GuardedLink.halt`.

        It is disabled then (section 16).
        """
        self._stop(frozenset(self._moved))

    def rest(self) -> None:
        """Stop what a check has left in motion; see :meth:`.GuardedLink.rest`."""
        self._stop(frozenset(self.moving))

    def _stop(self, axes: frozenset[int]) -> None:
        """Stop some axes, whatever has happened.

        Of a command that lost a byte on its way the next one becomes a part, and is ignored. So each stop is
        sent twice, behind a colon where something may be open.
        """
        if axes and not self._in_step:
            self._write_now(self._end, lambda: "ends what may be open")
        for axis in sorted(axes) * 2:
            frame = CommandFrame(m.StopMotor(), axis)
            self._write_now(frame.encode(), partial(self._words, frame))
        self.stopped |= axes
        self.moving -= axes
        self._moved -= axes

    def leave(self) -> None:
        """Switch back to the format in which the controller was found; see :meth:`.GuardedLink.leave`."""
        if self._found_in_text:
            self.settle()
            frame = CommandFrame(m.SwitchToHighLevel())
            self._write(frame.encode(), partial(self._words, frame))

    def _words(self, frame: CommandFrame) -> str:
        """Return a command in one line: what it is, of which axis, and its values."""
        words = message_text(frame.message).split(" ", 1)
        if frame.axis is not None:
            place = self.declared.place_at(frame.axis)
            words.insert(1, f"of axis {place.name if place else f'{frame.axis:#04x}'}")
        if frame.extra:
            words.append(f"extra={frame.extra.hex()}")
        if frame.form != "request":
            words.append("with a size slot" if frame.sized else "without its size slot")
        return " ".join(words)

    def _until_quiet(self, quiet: float, about: str) -> bytes:
        """Return what comes until nothing did for ``quiet`` seconds."""
        end = self.now + _LIMIT
        while self._fill(quiet) and self.now < end:
            pass
        return self._out(len(self._waiting), about)

    def _fill(self, timeout: float) -> bool:
        """Take what is there, or what comes first within ``timeout`` seconds; say whether anything came."""
        data = self._read(timeout)
        self._waiting += data
        if data:
            self._stirred = self.now
        return bool(data)

    def _out(self, size: int, about: str | Callable[[bytes], str]) -> bytes:
        """Give out what came, ``size`` bytes at most, and note it."""
        raw, self._waiting = self._waiting[:size], self._waiting[size:]
        if raw:
            tell = about if callable(about) else lambda _: about
            self._record(raw, lambda: tell(raw))
        return raw


def _reply_text(raw: bytes, reply: type[Reply]) -> str:
    """Return a reply in one line."""
    if len(raw) != reply.layout.length:
        return f"{len(raw)} of {reply.layout.length} bytes of a reply"
    try:
        return message_text(reply.unpack(raw))
    except CodecError as error:
        return str(error)
