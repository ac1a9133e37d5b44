"""What may be sent to a controller of commands without a frame: only what was allowed, whatever a check does.

A reply has no frame, and a command no checksum. So two things have to be seen to here: bytes that are no
command must not become one when some of them are lost, and nothing that sets or moves may follow bytes that
a controller may still be reading as the beginning of something.
"""

from __future__ import annotations

from typing import Final

from stagewire.protocols import CommandFrame, CommandProtocol
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.errors import NotAllowedError
from stagewire_conformance.device.permissions import Permissions, RangeError

_LINE_ENDS: Final = b"\r\n"
"""Would end a line of text, should the controller be reading text."""


class CommandGuard:
    """Refuses what the permissions do not open.

    :param protocol: has the bytes of all commands.
    :param declared: what is at the other end.
    :param allowed: what may be sent to it.
    """

    def __init__(
        self, protocol: CommandProtocol, declared: Declaration, allowed: Permissions
    ) -> None:
        self._prefix = protocol.marks.prefix
        self._setup = protocol.marks.setup
        self._commands = {byte: request.name for byte, request in protocol.rule.requests.items()}
        self._entries = declared.registry.messages
        self._declared = declared
        self._allowed = allowed

    def moves(self, frame: CommandFrame) -> bool:
        """Return whether a command may set an axis in motion."""
        return self._effect(frame.message.layout.message) == "motion"

    def check(self, frame: CommandFrame, raw: bytes, in_step: bool) -> None:
        """Refuse a command that is not allowed.

        :param raw: its bytes.
        :param in_step: whether all that was sent before it was whole.

        Raises :class:`~stagewire_conformance.device.errors.NotAllowedError`; nothing was sent then.
        """
        name = frame.message.layout.message
        if not self._opens(name):
            why = "it is a dummy" if self._is_dummy(name) else f"its effect is {self._effect(name)}"
            raise NotAllowedError(f"{name} is not allowed: {why}")
        if not in_step and not self._only_asks(name) and not self._enters(name):
            raise NotAllowedError(f"{name} must not follow bytes that were no whole command")
        for at in range(1, len(raw) - 1):
            inner = self._setup.get(raw[at + 1]) if raw[at] == self._prefix else None
            if inner is not None and not self._enters(inner):
                raise NotAllowedError(f"{name} is not allowed with this value: it holds {inner}")
        if self.moves(frame):
            self._check_target(frame)
        self.check_bytes(frame.extra)

    def _check_target(self, frame: CommandFrame) -> None:
        """Refuse a place to go to that lies outside the range."""
        name, axis, motion = frame.message.layout.message, frame.axis, self._allowed.motion
        place = None if axis is None else self._declared.place_at(axis)
        if place is None or motion is None:
            raise NotAllowedError(f"{name} is not allowed: no axis {axis} is declared")
        for field, entry in self._declared.registry.fields(name, "request").items():
            if entry.get("target") != "absolute":
                continue
            try:
                low, high = self._declared.reach(place, None, motion)
            except RangeError as error:
                raise NotAllowedError(f"{name} is not allowed: {error}") from None
            goal = getattr(frame.message, field)
            if not low <= goal <= high:
                raise NotAllowedError(
                    f"{name} of axis {place.name} is not allowed: {field} {goal} lies outside {low}..{high}"
                )

    def check_bytes(self, raw: bytes) -> None:
        """Refuse bytes that need be no command, if any part of them could be one that is not allowed.

        No byte may be that of a command which moves or stops, wherever it stands, and of one which sets only
        where settings are allowed; and no prefix may stand before the letter of a setup command, small or
        capital. So whatever is lost, and wherever a controller begins to read, nothing moves.

        Raises :class:`~stagewire_conformance.device.errors.NotAllowedError`; nothing was sent then.
        """
        for at, byte in enumerate(raw):
            name = self._commands.get(byte)
            if name is not None and not self._only_asks(name) and not self._only_sets(name):
                raise NotAllowedError(f"{raw.hex(' ')}: byte {at} is that of {name}")
            if byte in _LINE_ENDS:
                raise NotAllowedError(f"{raw.hex(' ')}: byte {at} ends a line of text")
            if byte == self._prefix:
                self._check_prefix(raw, at)

    def _check_prefix(self, raw: bytes, at: int) -> None:
        letter = raw[at + 1 : at + 2].upper()
        if not letter:
            raise NotAllowedError(f"{raw.hex(' ')}: what is sent next would follow the prefix")
        name = self._setup.get(letter[0])
        if name is not None and not self._enters(name) and not self._switches(name):
            raise NotAllowedError(f"{raw.hex(' ')}: bytes {at} and {at + 1} may be {name}")

    def _effect(self, name: str) -> str | None:
        effect: str | None = self._entries[name]["effect"]
        return effect

    def _opens(self, name: str) -> bool:
        """Return whether a command may be sent; a dummy, which is "not to be used", never."""
        if self._is_dummy(name):
            return False
        return self._enters(name) or self._switches(name) or self._allowed.opens(self._effect(name))

    def _is_dummy(self, name: str) -> bool:
        return bool(self._entries[name].get("dummy"))

    def _enters(self, name: str) -> bool:
        """Return whether it leads into the format of commands, into which there is no other way."""
        return bool(self._entries[name].get("switches_to") == "low_level")

    def _switches(self, name: str) -> bool:
        """Return whether it switches to another format, and may be sent."""
        return self._effect(name) == "connection" and self._allowed.settings

    def _only_asks(self, name: str) -> bool:
        return self._effect(name) == "none"

    def _only_sets(self, name: str) -> bool:
        return self._effect(name) == "settings" and self._allowed.settings
