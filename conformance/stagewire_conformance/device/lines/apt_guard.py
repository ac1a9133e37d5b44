"""What may be sent to a controller whose messages have frames: only what was allowed, whatever a check does.

A message is known by its effect in the registry. Bytes that are to be no message, such as those of a frame
that is cut off, are looked through for one all the same: a controller that has lost its place may begin to
read anywhere.
"""

from __future__ import annotations

from typing import Final

from stagewire.protocols import DATA_FLAG, HEADER_SIZE, FramedMessage, FramedProtocol
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.errors import NotAllowedError
from stagewire_conformance.device.permissions import Permissions, RangeError

_ABSOLUTE: Final = "absolute"


class AptGuard:
    """Refuses what the permissions do not open.

    :param declared: what is at the other end.
    :param allowed: what may be sent to it.
    """

    def __init__(self, declared: Declaration, allowed: Permissions) -> None:
        self._declared = declared
        self._allowed = allowed
        protocol = declared.protocol
        assert isinstance(protocol, FramedProtocol)
        self._host, self._devices = protocol.host, protocol.devices
        entries = declared.registry.messages
        self._effects = {
            name: entry["effect"]
            for name, entry in entries.items()
            if entry["direction"] != "to_host"
        }
        self._closed = {
            entry["id"]: name
            for name, entry in entries.items()
            if name in self._effects and not allowed.opens(entry["effect"])
        }

    def effect(self, message: str) -> str | None:
        """Return what a message does; None for one that no controller takes."""
        return self._effects.get(message)

    def check(self, message: FramedMessage, dest: int) -> None:
        """Refuse a message that is not allowed.

        Raises :class:`~stagewire_conformance.device.errors.NotAllowedError`; nothing was sent then.
        """
        name = message.layout.message
        effect = self.effect(name)
        if not self._allowed.opens(effect):
            what = "no controller takes it" if effect is None else f"its effect is {effect}"
            raise NotAllowedError(f"{name} to {dest:#04x} is not allowed: {what}")
        if effect == "motion":
            self._check_target(message, dest)

    def _check_target(self, message: FramedMessage, dest: int) -> None:
        """Refuse a place to go to that lies outside the range, where it can be told."""
        name, motion = message.layout.message, self._allowed.motion
        place = self._declared.place_at(dest)
        if place is None or motion is None:
            raise NotAllowedError(
                f"{name} to {dest:#04x} is not allowed: nothing is declared there"
            )
        channel = getattr(message, "chan_ident", None)
        if channel is not None and channel not in place.channels:
            raise NotAllowedError(
                f"{name} to {dest:#04x} is not allowed: no channel {channel} is declared there"
            )
        fields = self._declared.registry.fields(name, message.layout.form)
        for field, entry in fields.items():
            if entry.get("target") != _ABSOLUTE or entry["quantity"] != "position":
                continue
            try:
                low, high = self._declared.reach(place, channel, motion)
            except RangeError as error:
                raise NotAllowedError(f"{name} to {dest:#04x} is not allowed: {error}") from None
            if not low <= getattr(message, field) <= high:
                raise NotAllowedError(
                    f"{name} to {dest:#04x} is not allowed: {field} {getattr(message, field)} lies "
                    f"outside {low}..{high}"
                )

    def refusal(self, raw: bytes) -> str:
        """Return why bytes may not be sent; empty if they may.

        Refused is what has the id of a message that may not be sent where a header can be: at the beginning
        whatever follows, elsewhere if one of the addresses behind it, as far as they are there, is right.
        """
        for at in range(len(raw) - 1):
            name = self._closed.get(raw[at] | raw[at + 1] << 8)
            if name is not None and (at == 0 or self._is_header(raw[at : at + HEADER_SIZE])):
                return f"byte {at} begins {name}, which is not allowed"
        return ""

    def _is_header(self, header: bytes) -> bool:
        """Return whether bytes can be a header, or become one with what is sent next."""
        dest, source = header[4:5], header[5:6]
        if not dest or dest[0] & ~DATA_FLAG in self._devices:
            return True
        return source == bytes((self._host,))

    def check_bytes(self, raw: bytes) -> None:
        """Refuse bytes that hold a message that is not allowed.

        Raises :class:`~stagewire_conformance.device.errors.NotAllowedError`; nothing was sent then.
        """
        why = self.refusal(raw)
        if why:
            raise NotAllowedError(f"{raw.hex(' ')}: {why}")
