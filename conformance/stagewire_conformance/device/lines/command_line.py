"""The guarded link to a controller with unframed commands.

A reply has no frame. Only the command gives it a meaning: the line sends a request, waits for the expected
number of bytes, and treats bytes that follow shortly after them as extra.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

from stagewire.errors import CodecError
from stagewire.links import Link
from stagewire.protocols import Command, CommandFrame, CommandProtocol, Reply, SetupCommand
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.lines.command_contact import first_contact
from stagewire_conformance.device.lines.command_guard import CommandGuard
from stagewire_conformance.device.lines.dialogue import message_text
from stagewire_conformance.device.lines.line import GuardedLink
from stagewire_conformance.device.lines.standstill import Measure, Part, Sighting
from stagewire_conformance.device.permissions import Permissions
from stagewire_ms2000 import messages as m

QUIET: Final = 0.05
"""Seconds of silence after which a reply is complete."""

_LIMIT: Final = 1.0
"""Maximum time in seconds to read from a controller that never stops sending."""
_SOON: Final = 0.3
"""Seconds within which a healthy controller answers a request."""
_UNASKED: Final = "unsolicited"


class CommandLine(GuardedLink):
    """Sends commands and receives replies.

    After bytes that are not a command or after a command in another form than the printed one, it is
    unknown where a controller begins to read. Only requests may follow them, until :meth:`settle` has
    brought both sides back into step.

    :param link: an open link. It is not closed.
    :param declared: the controller.
    :param allowed: the permissions. Other commands are refused, see :class:`.CommandGuard`.
    """

    stop_rule = "stop-disables"

    def __init__(self, link: Link, declared: Declaration, allowed: Permissions) -> None:
        super().__init__(link, declared, allowed)
        protocol = declared.protocol
        assert isinstance(protocol, CommandProtocol)
        self._end = bytes((protocol.marks.terminator,))
        self._guard = CommandGuard(protocol, declared, allowed)
        self._waiting = b""  # received but not yet used
        self._in_step = True
        self._found_in_text = False
        self._stirred = self.now  # time of the last traffic
        self.unasked = b""
        """Bytes received without a request since the line was last settled."""
        self.silent = ""
        """The command without a reply that was sent last before :attr:`unasked`; empty if it was another."""
        self.moving: set[int] = set()
        """Axes that may be moving. A check removes an axis once it has reported rest."""
        # the same, including axes that have reported rest in this check, and suspects
        self._moved: set[int] = set()
        # axes whose last motion has a speed instead of a target
        self._at_speed: set[int] = set()
        self.stopped: set[int] = set()
        """Axes that were stopped, which disables them until they are started again (section 16)."""

    # Sending

    def send(
        self,
        command: Command | SetupCommand,
        axis: int | None = None,
        *,
        sized: bool | None = None,
        extra: bytes = b"",
    ) -> None:
        """Send a command without waiting for a reply.

        :param axis: its identifier; None for a setup command.
        :param sized: whether to include the size slot; None for the form that the document prints.
        :param extra: bytes between its data and the colon, which a controller ignores.

        Raises :class:`~stagewire_conformance.device.errors.NotAllowedError` for a forbidden command.
        """
        frame = CommandFrame(command, axis, extra, sized)
        raw = frame.encode(allow_dummy=True)  # the guard refuses dummies
        self._guard.check(frame, raw, self._in_step)
        if axis is not None and self._guard.moves(frame):
            self.moving.add(axis)
            self._moved.add(axis)
            self._note_speed(axis, command)
            self._starts()
        if isinstance(command, m.StopMotor):
            self.stopped.add(frame.axis or 0)
        elif isinstance(command, m.StartMotor):
            self.stopped.discard(frame.axis or 0)
        if getattr(command, "reply", None) is None:
            self._fill(0)
            self.unasked += self._out(len(self._waiting), _UNASKED)
            if not self.unasked:
                self.silent = command.layout.message
        if frame.extra or frame.form != "request":
            self._in_step = False  # a controller may read it differently
        self._write(raw, partial(self._words, frame))
        self._stirred = self.now

    def suspect(self, axis: int) -> None:
        """Also stop this axis if the check is interrupted: a faulty controller may move it now."""
        self._moved.add(axis)

    def send_bytes(self, raw: bytes, about: str = "") -> None:
        """Send bytes that need not be a command.

        :param about: a description for the log.

        Raises :class:`~stagewire_conformance.device.errors.NotAllowedError` if any part of them could be a
        forbidden command.
        """
        self._guard.check_bytes(raw)
        self._in_step = False
        self._write(raw, lambda: about)
        self._stirred = self.now

    # Receiving

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
        """Send a request and return exactly what arrives: the reply and all bytes after it.

        If there are more or fewer bytes than the reply has, it is not the reply.

        :param wait: seconds within which the reply must be complete.
        :param quiet: seconds of silence to wait for after the reply. With 0, late bytes go to
            :attr:`unasked`.
        """
        self._fill(0)
        self.unasked += self._out(len(self._waiting), _UNASKED)
        if not self.unasked:
            self.silent = ""
        self.send(command, axis, sized=sized, extra=extra)
        return self.hear(command, wait, quiet)

    def hear(self, command: Command, wait: float = 1.0, quiet: float = QUIET) -> bytes:
        """Return the reply to a command that was sent, and all bytes after it, as :meth:`ask` does."""
        reply = command.reply
        assert reply is not None  # every request has a reply
        return self.collect(reply.layout.length, wait, quiet, lambda raw: _reply_text(raw, reply))

    def collect(
        self,
        size: int,
        wait: float = 1.0,
        quiet: float = QUIET,
        about: str | Callable[[bytes], str] = "",
    ) -> bytes:
        """Return up to ``size`` bytes that arrive within ``wait`` seconds, and all bytes after them.

        :param about: a description for the log.
        """
        end = self.now + wait
        while len(self._waiting) < size and (left := end - self.now) > 0:
            self._fill(left)
        return self._out(size, about) + self._until_quiet(quiet, "not part of a reply")

    def listen(self, seconds: float) -> bytes:
        """Return everything received within some seconds."""
        end = self.now + seconds
        while (left := end - self.now) > 0:
            self._fill(left)
        return self._out(len(self._waiting), _UNASKED)

    # Used by a run

    def contact(self) -> dict[str, int | str]:
        """Request the identification of the axes; see :meth:`.GuardedLink.contact`.

        Without a right answer the controller may be in the other format. It is then switched to the command
        format, for which there is only one way (section 1), and :meth:`leave` switches it back.
        """
        identity, self._found_in_text = first_contact(self)
        return identity

    def settle(self) -> list[str]:
        """Get back into step, and read until the line is quiet; see :meth:`.GuardedLink.settle`.

        A colon ends an incomplete command. In a command that writes data, colons would be data (``3A 3A 3A``
        is a position) and would not help; but bytes that could begin such a command are only sent as a whole
        command. A controller that does not answer then is switched to the command format. If that does not
        help, the link is opened again, if it can be.
        """
        if not self._in_step:
            self._write(self._end, lambda: "ends an incomplete command")
            self._in_step = True
            self.unasked += self._until_quiet(QUIET, _UNASKED)
            if not self._answers():
                self.send(m.SwitchToLowLevel())  # the controller may have left this format
                if not self._answers() and self.reopen():
                    self.send(m.SwitchToLowLevel())
        silent = self.now - self._stirred  # often the check has already waited for silence
        came = self.unasked + self._until_quiet(max(0.0, QUIET - silent), _UNASKED)
        self.unasked, self.silent = b"", ""
        return [f"{came.hex(' ')}: {_UNASKED}"] if came else []

    def _answers(self) -> bool:
        """Return whether the controller answers a request."""
        return bool(self.ask(m.ReadStatus(), self.declared.places[0].address, _SOON, quiet=0))

    def pause(self, seconds: float) -> None:
        """Wait, and keep everything that arrives as unsolicited."""
        self.unasked += self.listen(seconds)

    def parts(self, *, going: bool = False) -> list[Part]:
        """Return the axes that were set in motion; see :meth:`.GuardedLink.parts`.

        A stop disables an axis (section 16). It is sent again if it has no effect. If the axis still moves at
        a vector speed, the speed 0 follows (section 25).
        """
        return [self._part(axis) for axis in sorted(self.moving if going else self._moved)]

    def others(self) -> list[Part]:
        """Return the other axes; see :meth:`.GuardedLink.others`."""
        axes = {place.address for place in self.declared.places}
        return [self._part(axis) for axis in sorted(axes - self._moved)]

    def _part(self, axis: int) -> Part:
        stop = partial(self._stop_axis, axis)
        measures = [Measure("STOP_MOTOR", stop), Measure("another STOP_MOTOR", stop)]
        if axis in self._at_speed:
            end = partial(self._end_speed, axis)
            measures.append(Measure("WRITE_VECTOR_SPEED 0", end, moves=True))
        return Part(f"axis {self._name(axis)}", tuple(measures), partial(self._look, axis))

    def _note_speed(self, axis: int, command: Command | SetupCommand) -> None:
        """Note whether a motion has a vector speed instead of a target."""
        if isinstance(command, m.WriteVectorSpeed):
            self._at_speed.add(axis)
        else:
            self._at_speed.discard(axis)

    def _end_speed(self, axis: int) -> None:
        """Set the vector speed of an axis to 0."""
        frame = CommandFrame(m.WriteVectorSpeed(0), axis)
        self._write_now(frame.encode(), partial(self._words, frame))

    def _stop_axis(self, axis: int) -> None:
        """Stop an axis.

        If a byte of a command was lost, the next command becomes part of it and is ignored. So each stop is
        sent twice, after a colon if a command may be incomplete.
        """
        if not self._in_step:
            self._write_now(self._end, lambda: "ends an incomplete command")
        frame = CommandFrame(m.StopMotor(), axis)
        for _ in range(2):
            self._write_now(frame.encode(), partial(self._words, frame))
        self.stopped.add(axis)
        self.moving.discard(axis)

    def _look(self, axis: int) -> Sighting | None:
        """Return the state of an axis: its position, and whether it reports a speed."""
        position = self._number(m.ReadMotorPosition(), axis)
        speed = self._number(m.ReadCurrentSpeed(), axis)
        if position is None or speed is None:
            return None
        return Sighting(self.now, position, speed != 0)

    def _number(self, request: Command, axis: int) -> int | None:
        """Return the number in the reply to a request; None without a whole reply."""
        assert request.reply is not None
        raw = self.ask(request, axis, _SOON, quiet=0.0)
        if len(raw) != request.reply.layout.length:
            return None
        reply = request.reply.unpack(raw)
        [field] = reply.layout.fields
        return int(getattr(reply, field))

    def _name(self, axis: int) -> str:
        place = self.declared.place_at(axis)
        return place.name if place else f"{axis:#04x}"

    def forget(self) -> None:
        """Forget all motions, before the next check."""
        self._moved.clear()
        self.moving.clear()
        self._rests = True

    def leave(self) -> None:
        """Switch back to the format in which the controller was found; see :meth:`.GuardedLink.leave`."""
        if self._found_in_text:
            self.settle()
            frame = CommandFrame(m.SwitchToHighLevel())
            self._write(frame.encode(), partial(self._words, frame))

    def _words(self, frame: CommandFrame) -> str:
        """Return a command in one line: its name, its axis, and its values."""
        words = message_text(frame.message).split(" ", 1)
        if frame.axis is not None:
            words.insert(1, f"of axis {self._name(frame.axis)}")
        if frame.extra:
            words.append(f"extra={frame.extra.hex()}")
        if frame.form != "request":
            words.append("with a size slot" if frame.sized else "without its size slot")
        return " ".join(words)

    def _until_quiet(self, quiet: float, about: str) -> bytes:
        """Return received bytes until the line was quiet for ``quiet`` seconds."""
        end = self.now + _LIMIT
        while self._fill(quiet) and self.now < end:
            pass
        return self._out(len(self._waiting), about)

    def _fill(self, timeout: float) -> bool:
        """Receive bytes, waiting up to ``timeout`` seconds for the first; return whether any arrived."""
        data = self._read(timeout)
        self._waiting += data
        if data:
            self._stirred = self.now
        return bool(data)

    def _out(self, size: int, about: str | Callable[[bytes], str]) -> bytes:
        """Return up to ``size`` received bytes, and log them."""
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
