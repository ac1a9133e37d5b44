"""The guard for controllers with framed messages: it lets only allowed messages pass.

A message is judged by its effect and its hazard in the registry. One that the registry marks as not sent,
such as one whose id the sources contradict, is always forbidden. Arbitrary bytes, such as a truncated frame,
are searched for forbidden messages, because a controller that is out of step may start to read at any byte.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from stagewire.protocols import DATA_FLAG, HEADER_SIZE, FramedMessage, FramedProtocol
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.errors import NotAllowedError
from stagewire_conformance.device.permissions import Need, Permissions, RangeError, needs_of

if TYPE_CHECKING:
    from stagewire_conformance.device.targets import Target

_ABSOLUTE: Final = "absolute"


class AptGuard:
    """Refuses messages that the permissions do not allow.

    :param declared: the controller.
    :param allowed: the permissions.
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
        self._not_sent: dict[str, str] = {
            name: entry.get("not_sent", "") for name, entry in entries.items()
        }
        self._framing = protocol.framing
        self._closed: dict[int, list[str]] = {}  # id -> its forbidden messages
        for name in self._effects:
            if self._why_closed(name):
                self._closed.setdefault(entries[name]["id"], []).append(name)

    def effect(self, message: str) -> str | None:
        """Return the effect of a message; None if controllers do not receive it."""
        return self._effects.get(message)

    def check(self, message: FramedMessage, dest: int) -> None:
        """Refuse a forbidden message.

        Raises :class:`~stagewire_conformance.device.errors.NotAllowedError`. Nothing is sent then.
        """
        name = message.layout.message
        place = self._declared.place_at(dest)
        why = self._why_closed(name, place)
        if why:
            raise NotAllowedError(f"{name} to {dest:#04x} is not allowed: {why}")
        if Need.MOTION in (needs_of(self.effect(name), self._declared.hazard(name, place)) or ()):
            self._check_target(message, dest)

    def _why_closed(self, message: str, place: Target | None = None) -> str:
        """Return why a message is forbidden whatever its values, or an empty string.

        :param place: where it is sent; None for anywhere.
        """
        effect, hazard = self.effect(message), self._declared.hazard(message, place)
        if self._allowed.opens(effect, hazard):
            return self._not_sent[message]
        if effect is None:
            return "controllers do not receive it"
        if hazard and Need(hazard) not in self._allowed.granted:
            return f"its hazard is {hazard}, which needs --allow-{hazard}"
        return f"its effect is {effect}"

    def _check_target(self, message: FramedMessage, dest: int) -> None:
        """Refuse a target position outside the range."""
        name, motion = message.layout.message, self._allowed.motion
        place = self._declared.place_at(dest)
        if place is None or motion is None:
            raise NotAllowedError(
                f"{name} to {dest:#04x} is not allowed: no unit is declared at this address"
            )
        channel = getattr(message, "chan_ident", None)
        if channel is not None and channel not in place.channels:
            raise NotAllowedError(
                f"{name} to {dest:#04x} is not allowed: channel {channel} is not declared at this address"
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
                    f"{name} to {dest:#04x} is not allowed: {field} {getattr(message, field)} is "
                    f"outside {low}..{high}"
                )

    def refusal(self, raw: bytes) -> str:
        """Return why bytes may not be sent, or an empty string.

        The bytes are refused if the id of a forbidden message is where a header can begin: at the first byte
        in any case, elsewhere if one of the two address bytes after it is a valid address. If the bytes end
        before these, only messages of the declared units count. At the first byte, a message with an allowed
        sub-message is not refused because of others with its id.
        """
        for at in range(len(raw) - 1):
            closed = self._closed.get(raw[at] | raw[at + 1] << 8, [])
            header = raw[at : at + HEADER_SIZE]
            if at:
                name = next((each for each in closed if self._is_header(header, each)), "")
            else:
                name = self._first(raw, closed)
            if name:
                return f"byte {at} begins {name}, which is not allowed"
        return ""

    def _first(self, raw: bytes, closed: Sequence[str]) -> str:
        """Return the forbidden message that bytes begin with; empty if they begin with an allowed one."""
        key = self._framing.key_of(raw) if len(raw) >= HEADER_SIZE else 0
        if key not in self._framing.shared:  # an id alone does not decide between its sub-messages
            name = self._framing.names.get(key, "")
            if name:
                return name if name in closed else ""
        return closed[0] if closed else ""

    def _is_header(self, header: bytes, name: str) -> bool:
        """Return whether bytes are a header, or may become one of a message with the next bytes sent."""
        dest, source = header[4:5], header[5:6]
        if not dest:
            return self._declared.claims(name)
        return dest[0] & ~DATA_FLAG in self._devices or source == bytes((self._host,))

    def check_bytes(self, raw: bytes) -> None:
        """Refuse bytes that contain a forbidden message.

        Raises :class:`~stagewire_conformance.device.errors.NotAllowedError`. Nothing is sent then.
        """
        why = self.refusal(raw)
        if why:
            raise NotAllowedError(f"{raw.hex(' ')}: {why}")
