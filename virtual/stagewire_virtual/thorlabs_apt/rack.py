"""Parts of a unit as a whole: bays, the USER IO connector, and the lock of its top panel (pages 23 to 26)."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, Final

from stagewire import Frame, Protocol
from stagewire_apt import messages as m
from stagewire_apt.enumerations import BayState, RackBay
from stagewire_apt.flags import RackDigitalOutputs
from stagewire_virtual.instrument import Unit
from stagewire_virtual.thorlabs_apt.transmitter import Handler, Responder

RACK: Final = "RACK"
"""The name of a rack of modules; the document has the modules, but not such a unit."""

BAYS: Final = len(RackBay)
"""The number of bays of a rack (page 23); on the wire the first one is 0."""

_ALL_OUTPUTS: Final = sum(RackDigitalOutputs.bits.values())


class Bays:
    """The bays of a motherboard.

    :param occupied: the bays that contain a card or module, counted from 0.
    """

    def __init__(self, occupied: Collection[int]) -> None:
        self._occupied = frozenset(occupied)

    def handlers(self, controller: Responder) -> Mapping[str, Handler]:
        """Return the handlers of its messages, which answer through ``controller``."""

        def is_used(frame: Frame) -> None:
            message: Any = frame.message
            bay = message.bay_ident
            if bay < BAYS:
                state = BayState.OCCUPIED if bay in self._occupied else BayState.EMPTY
                controller.send(m.RackGetBayUsed(bay, state), frame)
            else:
                controller.refuse(frame, f"unknown bay {bay} (bays are 0 to {BAYS - 1})")

        return {"RACK_REQ_BAYUSED": is_used}


class UserIo:
    """The USER IO connector of a motherboard, of a module, or of a unit without bays.

    The status bits are the inputs: pages 25 and 26 exchange the tables of inputs and outputs, see the errata.
    """

    def __init__(self) -> None:
        self._status = m.RackGetStatusBits(0)
        self.outputs = 0
        """The four digital outputs, as bits of RACK_SET_DIGOUTPUTS; low after power-on."""

    @property
    def inputs(self) -> int:
        """The digital inputs, as bits of RACK_GET_STATUSBITS, which the user can set.

        Setting a value that does not fit in 32 bits raises :class:`~stagewire.errors.EncodeError`.
        """
        return self._status.status_bits

    @inputs.setter
    def inputs(self, inputs: int) -> None:
        self._status = m.RackGetStatusBits(inputs)

    def handlers(self, controller: Responder) -> Mapping[str, Handler]:
        """Return the handlers of its messages, which answer through ``controller``."""

        def send_inputs(frame: Frame) -> None:
            controller.send(self._status, frame)

        def set_outputs(frame: Frame) -> None:
            message: Any = frame.message
            self.outputs = message.dig_op & _ALL_OUTPUTS

        def send_outputs(frame: Frame) -> None:
            controller.send(m.RackGetDigOutputs(self.outputs), frame)

        return {
            "RACK_REQ_STATUSBITS": send_inputs,
            "RACK_SET_DIGOUTPUTS": set_outputs,
            "RACK_REQ_DIGOUTPUTS": send_outputs,
        }


_LOCKED: Final = 1  # no enumeration: packages of earlier issues have neither it nor these messages
_UNLOCKED: Final = 2


class PanelLock:
    """The lock of the controls on the top panel of a K-Cube; unlocked after power-up (Issue 37, page 59)."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Unlock the controls."""
        self._state = _UNLOCKED

    @property
    def is_locked(self) -> bool:
        """Whether the controls are locked."""
        return self._state == _LOCKED

    def handlers(self, controller: Responder) -> Mapping[str, Handler]:
        """Return the handlers of its messages, which answer through ``controller``."""

        def lock(frame: Frame) -> None:
            message: Any = frame.message
            if message.mmi_lock in (_LOCKED, _UNLOCKED):
                self._state = message.mmi_lock
            else:
                controller.refuse(frame, f"the lock must be 1 or 2, not {message.mmi_lock}")

        def send_state(frame: Frame) -> None:
            controller.send(m.HwGetKcubeMmiLock(mmi_lock=self._state), frame)

        return {"HW_SET_KCUBEMMILOCK": lock, "HW_REQ_KCUBEMMILOCK": send_state}


def modular_rack(protocol: Protocol, registry: Mapping[str, Any], bays: int) -> Unit:
    """Return a unit for a rack of modules; it has the messages of racks, and no channels."""
    messages = [
        entry["name"]
        for entry in registry["messages"]
        if entry["name"].startswith(("HW_", "MOD_IDENTIFY", "RACK_"))
    ]
    facts = {
        "name": RACK,
        "title": "19 inch rack of modules",
        "address": "rack",
        "bays": bays,
        "channels": 0,
        "keep_alive": "none",
        "messages": messages,
        "stages": [],
    }
    return Unit(RACK, protocol, facts, {}, registry)
