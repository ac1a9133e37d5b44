"""The guard for controllers with unframed commands: it lets only allowed commands pass.

Replies have no frame, and commands no checksum. So the guard also ensures that arbitrary bytes cannot become
a forbidden command when some of them are lost, and that no command that sets or moves follows bytes that a
controller may read as the beginning of a command.
"""

from __future__ import annotations

from typing import Final

from stagewire.protocols import CommandFrame, CommandProtocol
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.errors import NotAllowedError
from stagewire_conformance.device.permissions import Permissions, RangeError

_LINE_ENDS: Final = b"\r\n"
"""Bytes that end a line, if the controller is reading text."""


class CommandGuard:
    """Refuses commands that the permissions do not allow.

    :param protocol: defines the bytes of all commands.
    :param declared: the controller.
    :param allowed: the permissions.
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
        """Refuse a forbidden command.

        :param raw: its bytes.
        :param in_step: whether everything sent before it was a complete command.

        Raises :class:`~stagewire_conformance.device.errors.NotAllowedError`. Nothing is sent then.
        """
        name = frame.message.layout.message
        if not self._opens(name):
            why = "it is a dummy" if self._is_dummy(name) else f"its effect is {self._effect(name)}"
            raise NotAllowedError(f"{name} is not allowed: {why}")
        if not in_step and not self._only_asks(name) and not self._enters(name):
            raise NotAllowedError(f"{name} must not follow bytes that were not a complete command")
        for at in range(1, len(raw) - 1):
            inner = self._setup.get(raw[at + 1]) if raw[at] == self._prefix else None
            if inner is not None and not self._enters(inner):
                raise NotAllowedError(f"{name} is not allowed with this value: it contains {inner}")
        if self.moves(frame):
            self._check_target(frame)
        self.check_bytes(frame.extra)

    def _check_target(self, frame: CommandFrame) -> None:
        """Refuse a target position outside the range."""
        name, axis, motion = frame.message.layout.message, frame.axis, self._allowed.motion
        place = None if axis is None else self._declared.place_at(axis)
        if place is None or motion is None:
            raise NotAllowedError(f"{name} is not allowed: axis {axis} is not declared")
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
                    f"{name} of axis {place.name} is not allowed: {field} {goal} is outside {low}..{high}"
                )

    def check_bytes(self, raw: bytes) -> None:
        """Refuse arbitrary bytes if any part of them could be a forbidden command.

        No byte may be that of a command that moves or stops, at any position. Commands that change settings
        are refused unless settings are allowed. The prefix must not precede the letter of a setup command, in
        lower or upper case. So nothing moves, whichever bytes are lost and wherever a controller begins to
        read.

        Raises :class:`~stagewire_conformance.device.errors.NotAllowedError`. Nothing is sent then.
        """
        for at, byte in enumerate(raw):
            name = self._commands.get(byte)
            if name is not None and not self._only_asks(name) and not self._only_sets(name):
                raise NotAllowedError(f"{raw.hex(' ')}: byte {at} is the command {name}")
            if byte in _LINE_ENDS:
                raise NotAllowedError(f"{raw.hex(' ')}: byte {at} ends a line of text")
            if byte == self._prefix:
                self._check_prefix(raw, at)

    def _check_prefix(self, raw: bytes, at: int) -> None:
        letter = raw[at + 1 : at + 2].upper()
        if not letter:
            raise NotAllowedError(f"{raw.hex(' ')}: the next byte sent would follow the prefix")
        name = self._setup.get(letter[0])
        if name is not None and not self._enters(name) and not self._switches(name):
            raise NotAllowedError(f"{raw.hex(' ')}: bytes {at} and {at + 1} may be {name}")

    def _effect(self, name: str) -> str | None:
        effect: str | None = self._entries[name]["effect"]
        return effect

    def _opens(self, name: str) -> bool:
        """Return whether a command may be sent. A dummy, which is "not to be used", never is."""
        if self._is_dummy(name):
            return False
        return self._enters(name) or self._switches(name) or self._allowed.opens(self._effect(name))

    def _is_dummy(self, name: str) -> bool:
        return bool(self._entries[name].get("dummy"))

    def _enters(self, name: str) -> bool:
        """Return whether a command switches to the command format, the only way into it."""
        return bool(self._entries[name].get("switches_to") == "low_level")

    def _switches(self, name: str) -> bool:
        """Return whether a command switches to another format, and may be sent."""
        return self._effect(name) == "connection" and self._allowed.settings

    def _only_asks(self, name: str) -> bool:
        return self._effect(name) == "none"

    def _only_sets(self, name: str) -> bool:
        return self._effect(name) == "settings" and self._allowed.settings
