"""Parameter sets: SET stores them, REQ returns them, and the EEPROM keeps them."""

from __future__ import annotations

import functools
from collections.abc import Collection, Mapping, Sequence
from typing import Any, Final

from stagewire import Frame, FramedMessage
from stagewire_apt.enumerations import EnableState
from stagewire_virtual.instrument import Unit
from stagewire_virtual.thorlabs_apt.channel import Behaviour, Channel
from stagewire_virtual.thorlabs_apt.facts import CHANNEL, Message, class_of, facts_of
from stagewire_virtual.thorlabs_apt.transmitter import Responder

SAVING: Final = frozenset(
    {
        "MOT_SET_EEPROMPARAMS",
        "PZ_SET_EEPROMPARAMS",
        "NT_SET_EEPROMPARAMS",
        "LA_SET_EEPROMPARAMS",
        "QUAD_SET_EEPROMPARAMS",
        "TEC_SET_EEPROMPARAMS",
    }
)
"""The messages that save parameters (pages 60 and 113; Issue 37, pages 290, 310, 353 and 366)."""

_ENABLE_STATE: Final = "MOD_CHANENABLESTATE"
"""The set that enables and disables a channel, in addition to being stored (page 17)."""

_COMMON: Final[Mapping[str, Collection[str]]] = {"PZ_IOSETTINGS": ("amp_lp_filter",)}
"""Values that all channels of a controller share; the first channel stores them (page 119).

The only unit with this set has no message to save it.
"""

_NONE: Final = 0
_BOTH: Final = 3  # CHANBOTH: pages 27 and 93 mention it without a number


def addressed(
    channels: Sequence[Channel], frame: Frame, controller: Responder
) -> Sequence[Channel]:
    """Return the channels that a frame addresses; all if it names none.

    Channel 0 is the only channel of a controller with one: the vendor's software and public drivers send it.
    A frame to a missing channel is refused, and the result is empty.
    """
    ident = getattr(frame.message, CHANNEL, None)
    if ident is None or (ident == _BOTH and len(channels) == 2):
        return channels
    if ident == _NONE and len(channels) == 1:
        return channels
    named = [channel for channel in channels if channel.ident == ident]
    if not named:
        controller.refuse(frame, f"unknown channel {ident}")
    return named


def new_parameters(channel: Channel, behaviour: type[Behaviour]) -> Mapping[str, Mapping[str, Any]]:
    """Return the parameters of a new controller, from its behaviour or else from the registry."""
    own = behaviour.defaults(channel)
    return {name: {**values, **own.get(name, {})} for name, values in _plain(channel.unit).items()}


@functools.lru_cache(maxsize=128)
def _plain(unit: Unit) -> Mapping[str, Mapping[str, Any]]:
    """Return the parameter sets of a unit with the defaults of the registry."""
    found: dict[str, dict[str, Any]] = {}
    for facts in facts_of(unit).values():  # the fields of a SET and its GET may differ
        of_the_rack = facts.of_the_unit and facts.addressee
        if facts.role in ("set", "get") and not of_the_rack and facts.name not in SAVING:
            defaults = {value.name: value.default for value in facts.values}
            found.setdefault(facts.set_name, {}).update(defaults)
    return found


class Parameters:
    """The parameter sets of a controller's channels.

    :param unit: the unit in the registry.
    :param channels: the channels of the controller.
    :param controller: sends the answers.
    """

    def __init__(self, unit: Unit, channels: Sequence[Channel], controller: Responder) -> None:
        self._channels = channels
        self._controller = controller
        self._facts = facts_of(unit)
        self._unit = unit
        self._sets_of_id: dict[int, list[Message]] = {}  # several for an id with sub-messages
        for facts in self._facts.values():
            if facts.role == "set" and facts.set_name in _plain(unit):
                self._sets_of_id.setdefault(facts.id, []).append(facts)
        self._selectors = {
            facts.set_name: facts.values
            for facts in self._facts.values()
            if facts.role == "req" and facts.values and facts.set_name in _plain(unit)
        }

    def store(self, facts: Message, frame: Frame) -> None:
        """Store the values of a SET, unless the document does not allow one of them.

        Flags, and values of tables that the registry marks as open, are stored unchecked.
        """
        sent = frame.message.layout.fields  # a shorter form has not all values
        told = [value for value in facts.values if value.name in sent]
        values = {value.name: getattr(frame.message, value.name) for value in told}
        for value in told:
            if fault := value.fault(values[value.name]):
                self._controller.refuse(frame, f"{facts.name}: {fault}")
                return
        by_mask = any(channel.behaviour.enables_by_mask for channel in self._channels)
        if facts.set_name == _ENABLE_STATE and by_mask:
            self._enable_by_mask(frame)
            return
        for channel in addressed(self._channels, frame, self._controller):
            if why := channel.behaviour.refusal(frame):
                self._controller.refuse(frame, f"{facts.name}: {why}")
                continue
            for which in self._selected(facts.set_name, values):
                channel.values_for(facts.set_name, which).update({**values, **which})
            for name in values.keys() & _COMMON.get(facts.set_name, ()):
                self._channels[0].parameters[facts.set_name][name] = values[name]
            obey_enable_state(channel)
            if stored := channel.behaviour.method("stored", facts.set_name):
                stored(frame)
            for name in facts.announces:
                if name in self._facts:
                    self._controller.send(self._message(name, channel, values), frame)

    def _enable_by_mask(self, frame: Frame) -> None:
        """Enable the channels in a mask and disable all others; with DISABLE, disable those in the mask."""
        message: Any = frame.message
        if unknown := message.chan_ident & ~sum(channel.ident for channel in self._channels):
            self._controller.refuse(frame, f"unknown channels {unknown:#04x} in the mask")
            return
        enables = message.enable_state == EnableState.ENABLE
        for channel in self._channels:
            named = bool(channel.ident & message.chan_ident)
            if enables or named:
                state = EnableState.ENABLE if enables and named else EnableState.DISABLE
                channel.parameters[_ENABLE_STATE]["enable_state"] = state
                obey_enable_state(channel)

    def answer(self, facts: Message, frame: Frame) -> None:
        """Answer a REQ with the GET of each addressed channel.

        If the GET names no channel, neither need the REQ: the vendor's software asks a KNA101 for
        NT_TNAIOSETTINGS with channel 0, and its simulation answers.
        """
        for_all = not any(self._facts[name].names_channel for name in facts.answered_by)
        if for_all and getattr(frame.message, CHANNEL, None) == _NONE:
            channels = self._channels[:1]
        else:
            channels = addressed(self._channels, frame, self._controller)
        asked = frame.message.values()
        for channel in channels if facts.names_channel else channels[:1]:
            for name in facts.answered_by:
                self._controller.send(self._message(name, channel, asked), frame)

    def save(self, frame: Frame) -> None:
        """Save the sets with the given SET id to the EEPROM, or all if the message has no id.

        A set without a channel is saved for all channels.
        """
        id = getattr(frame.message, "msg_id", None)
        every = [facts for sets in self._sets_of_id.values() for facts in sets]
        found = every if id is None else self._sets_of_id.get(id, [])
        if not found:
            self._controller.refuse(frame, f"{id:#06x} is not the id of a SET that can be saved")
            return
        named = addressed(self._channels, frame, self._controller)
        for facts in found if named else ():
            for channel in named if facts.names_channel else self._channels:
                channel.save(facts.set_name)

    def _selected(self, set_name: str, values: Mapping[str, Any]) -> list[dict[str, int]]:
        """Return the fields that select a connector of a set: one entry for each bit of a mask of connectors.

        A set that exists only once has one entry without fields.
        """
        found: list[dict[str, int]] = [{}]
        for selector in self._selectors.get(set_name, ()):
            value = values[selector.name]
            bits = [1 << at for at in range(value.bit_length()) if value >> at & 1]
            each = bits if selector.is_mask and bits else [value]
            found = [{**entry, selector.name: one} for entry in found for one in each]
        return found

    def _message(self, get: str, channel: Channel, asked: Mapping[str, Any]) -> FramedMessage:
        """Return the GET of a set, with live values where the behaviour has them, else stored ones."""
        facts = self._facts[get]
        which = self._selected(facts.set_name, asked)[0]
        values = {**channel.values_for(facts.set_name, which)}
        values.update((name, asked[name]) for name in which)
        for name in _COMMON.get(facts.set_name, ()):
            values[name] = self._channels[0].parameters[facts.set_name][name]
        if live := channel.behaviour.method("live", facts.set_name):
            values.update(live())
        found = class_of(self._unit, get)
        values = {name: value for name, value in values.items() if name in found.layout.fields}
        if facts.names_channel:
            values[CHANNEL] = channel.ident
        message = found(**values)
        amend = channel.behaviour.method("amends", get)
        return amend(message) if amend else message


def obey_enable_state(channel: Channel) -> None:
    """Enable or disable a channel according to its parameters, and notify its behaviour of a change."""
    enabled = channel.parameter(_ENABLE_STATE, "enable_state", EnableState.ENABLE) == (
        EnableState.ENABLE
    )
    if enabled != channel.enabled:
        channel.enabled = enabled
        channel.behaviour.enabled_changed()
