"""A Thorlabs APT controller, or a rack of them, on one line."""

from __future__ import annotations

import importlib
import random
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from stagewire.framing import (
    BadLength,
    Event,
    FrameEvent,
    Received,
    Undocumented,
    Unknown,
    UnknownSubMessage,
)
from stagewire.quantities import find_stages
from stagewire_apt import PROTOCOL
from stagewire_apt.messages import HwGetInfo
from stagewire_virtual.clock import Clock
from stagewire_virtual.errors import BadOptionError, UnknownPartError, VirtualError
from stagewire_virtual.framings import framing_of
from stagewire_virtual.framings.framing import RequestReader
from stagewire_virtual.instrument import Instrument, Row, Unit, units_of
from stagewire_virtual.options import Options, Settings, check_stage, known_only
from stagewire_virtual.thorlabs_apt import identity
from stagewire_virtual.thorlabs_apt.channel import Behaviour, Channel
from stagewire_virtual.thorlabs_apt.controller import Controller
from stagewire_virtual.thorlabs_apt.parameters import new_parameters
from stagewire_virtual.thorlabs_apt.quirks import (
    CLOCKWISE_IS_NEGATIVE,
    QUIRKS,
    ZERO_MOTION_PARAMETERS,
    without_motion,
)
from stagewire_virtual.thorlabs_apt.rack import BAYS, RACK, Bays, PanelLock, UserIo, modular_rack
from stagewire_virtual.thorlabs_apt.transmitter import Panel

_BY_MESSAGE: Final[tuple[tuple[str, str], ...]] = (
    # Before the motor, because they also have messages of motors:
    ("MOT_SET_SOL_STATE", "solenoid.Solenoid"),
    ("POL_SET_PARAMS", "paddles.Paddle"),
    ("PZMOT_MOVE_START", "inertial.pdxc2.OricChannel"),
    ("PZMOT_MOVE_ABSOLUTE", "inertial.cube.InertialCube"),
    ("MOT_MOVE_HOME", "motor.motor.Motor"),
    ("PZ_SET_OUTPUTVOLTS", "piezo.piezo.Piezo"),
    ("PZ_REQ_TSG_READING", "strain_gauge.StrainGauge"),
    ("MOT_REQ_MFF_OPERPARAMS", "flipper.Flipper"),
    ("LA_REQ_STATUSUPDATE", "laser.source.LaserSource"),
    ("LD_REQ_STATUSUPDATE", "laser.driver.DiodeDriver"),
    ("TEC_REQ_STATUSUPDATE", "tec.cooler.Cooler"),
    ("PZ_SET_NTMODE", "nanotrak.nanotrak.NanoTrak"),
    ("QUAD_SET_OPERMODE", "quad.Quad"),
)
"""Message -> behaviour, imported when it is needed: some use names that only an overlay generates."""


def behaviour_of(unit: Unit) -> type[Behaviour]:
    """Return the behaviour for the channels of a unit, according to its messages in the registry.

    Raises :class:`~stagewire_virtual.errors.VirtualError` if none matches.
    """
    if reason := AptInstrument.why_not(unit):
        raise VirtualError(reason)
    path = next(behaviour for message, behaviour in _BY_MESSAGE if message in unit.messages)
    module, _, name = f"{__package__}.{path}".rpartition(".")
    behaviour: type[Behaviour] = getattr(importlib.import_module(module), name)
    return behaviour


_DEFAULT: Final = Options()

_NOT_TAKEN: Final[dict[type[FrameEvent], str]] = {
    Unknown: "is an unknown message id",
    UnknownSubMessage: "has an unknown sub-message",
    Undocumented: "is the id of a message without a layout",
    BadLength: "has a packet that is too short",
}


class AptInstrument(Instrument):
    """A unit with one address, or the motherboard and the bays of a rack, on one line.

    A module comes with a rack of one bay. Frames to an unused address, and bytes outside a frame, get no
    answer.

    :param unit: its unit in the registry.
    :param clock: its clock, which several instruments may share.
    :param options: its options.
    :param modules: the modules in the bays of a rack; None for a unit that is not :data:`RACK`.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for an option that it does not support, and
    :class:`~stagewire_virtual.errors.VirtualError` for a unit whose channels cannot be simulated yet.
    """

    def __init__(
        self,
        unit: Unit,
        clock: Clock,
        options: Options = _DEFAULT,
        modules: Sequence[Unit | None] | None = None,
    ) -> None:
        super().__init__(unit, clock)
        known_only("quirk", options.quirks, QUIRKS, unit.name)
        known_only("strategy", options.strategies, (), unit.name)
        built = [unit] if modules is None else [module for module in modules if module is not None]
        for settings in options.channels:
            if settings.stage is not None:
                check_stage(settings.stage, [each.name for each in built])
        self._options = options
        self._reader = RequestReader(framing_of(unit.protocol), clock, self._take)
        self._connected = True  # until the host disconnects
        self._channels: dict[str, Channel] = {}  # by their names in rows
        self._controllers: dict[str, Controller] = {}  # by the prefix of their channels' names
        self._user_io: dict[int | None, UserIo] = {}  # by bay; None for the unit or motherboard
        self._panel_lock = PanelLock()
        self._by_address: dict[int, Controller] = {}
        if modules is None and unit.facts["address"] == "generic_usb":
            _check_bays(options.empty_bays, 0, unit)
            self._build_stand_alone()
        else:
            bays = [unit] * unit.facts.get("bays", 1) if modules is None else list(modules)
            _check_bays(options.empty_bays, len(bays), unit)
            self._build_rack(
                {bay: module for bay, module in enumerate(bays)
                 if module is not None and bay + 1 not in options.empty_bays}
            )  # fmt: skip
        if len(options.channels) > len(self._channels):
            raise BadOptionError(
                f"settings for {len(options.channels)} channels were given, but {unit.name} has "
                f"{len(self._channels)}"
            )

    @classmethod
    def why_not(cls, unit: Unit) -> str:
        """Return why a unit cannot be simulated yet; empty if it can."""
        if any(message in unit.messages for message, _ in _BY_MESSAGE):
            return ""
        known = ", ".join(message for message, _ in _BY_MESSAGE)
        return f"{unit.name} cannot be simulated yet: a virtual channel needs one of the messages {known}"

    # Building

    def _build_stand_alone(self) -> None:
        addresses = self.unit.registry["addresses"]
        found = self.unit.facts.get("also_at", self.unit.family.get("also_at", {}))
        also_at = found.get("addresses", ())
        io = self._user_io[None] = UserIo()
        settings = _with_built_in(self._options.settings(0), self.unit)
        information = identity.stand_alone(self.unit, self._options, settings.stage)
        panels: list[Panel] = [io, Bays([0]), self._panel_lock]
        controller = self._build(self.unit, "", information, panels, self.unit.facts["channels"])
        for address in (addresses["generic_usb"]["value"], *also_at):
            self._by_address[address] = controller

    def _build_rack(self, modules: Mapping[int, Unit]) -> None:
        addresses = self.unit.registry["addresses"]
        board = self.unit
        if board.facts["address"] != "rack":  # a module, which comes with its rack
            board = modular_rack(board.protocol, board.registry, 1)
        io = self._user_io[None] = UserIo()
        information = identity.motherboard(board, self._options, len(modules))
        motherboard = self._build(board, "motherboard", information, [io, Bays(modules)], 0)
        self._by_address[addresses["motherboard"]["value"]] = motherboard
        for bay, unit in modules.items():
            # A module has its own connector, a card uses that of its motherboard (pages 25 and 26).
            number = bay + 1  # on the wire, the first bay is 0
            self._user_io[number] = UserIo() if board.name == RACK else io
            information = identity.card(unit, self._options, bay)
            channels = unit.facts["channels"]
            controller = self._build(
                unit, f"bay {number}, ", information, [self._user_io[number]], channels
            )
            self._by_address[addresses["bays"]["first"] + bay] = controller

    def _build(
        self, unit: Unit, where: str, information: HwGetInfo, panels: Sequence[Panel], channels: int
    ) -> Controller:
        """Build a controller with its channels; ``where`` is the prefix of their names."""
        fitted: list[Channel] = []
        for number, ident in enumerate(_idents(unit, channels), 1):
            first = fitted[0] if fitted else None
            fitted.append(self._build_channel(unit, f"{where}channel {number}", ident, first))
        controller = Controller(
            unit,
            self.clock,
            self._options,
            information=information,
            channels=fitted,
            panels=panels,
            transmit=self._transmit,
            disconnect=self._disconnect,
            refused=lambda why: self.on_refusal(why),
        )
        self._controllers[where] = controller
        return controller

    def _build_channel(self, unit: Unit, name: str, ident: int, first: Channel | None) -> Channel:
        settings = _with_built_in(self._options.settings(len(self._channels)), unit)
        chance = random.Random(f"{self._options.seed}/{name}")
        clockwise = -1 if CLOCKWISE_IS_NEGATIVE in self._options.quirks else 1
        channel = Channel(ident, unit, self.clock, settings, chance, clockwise, first)
        behaviour = behaviour_of(unit)
        parameters = new_parameters(channel, behaviour)
        if ZERO_MOTION_PARAMETERS in self._options.quirks:
            parameters = without_motion(parameters)
        channel.initialize(parameters)
        channel.panel_is_locked = lambda: self._panel_lock.is_locked
        behaviour(channel)
        self._channels[name] = channel
        return channel

    # The line

    def receive(self, data: bytes) -> None:
        """Process bytes from the host, in any chunks."""
        self._reader.feed(data)

    def _take(self, event: Event) -> None:
        if not isinstance(event, FrameEvent):
            return  # garbage
        controller = self._by_address.get(event.dest)
        if controller is None:
            there = ", ".join(f"{address:#04x}" for address in self._by_address)
            self.on_refusal(
                f"{self.unit.name} does not use address {event.dest:#04x} (addresses: {there})"
            )
            return
        self._connected = True
        if isinstance(event, Received):
            controller.receive(event.frame)
        else:
            why = f"{event.id:#06x} {_NOT_TAKEN[type(event)]}"
            controller.refuse_from(event.source, event.dest, why)

    def _transmit(self, frame: bytes) -> None:
        if self._connected:
            self.on_send(frame)

    def _disconnect(self) -> None:
        """Stay silent until the next message, and stop updates until the host starts them (page 19)."""
        self._connected = False
        for controller in self._controllers.values():
            controller.stop_updates()

    # Outside the line

    def power_cycle(self) -> None:
        """Switch off and on. Only the EEPROM, digital inputs and the positions of the stages are kept."""
        self._reader.clear()
        self._connected = True
        self._panel_lock.reset()
        for io in self._user_io.values():
            io.outputs = 0
        for controller in self._controllers.values():
            controller.power_cycle()

    def rows(self) -> Sequence[Row]:
        """Return a row for each channel, and one for the motherboard of a rack."""
        return [
            row for where, controller in self._controllers.items() for row in controller.rows(where)
        ]

    def stick(self, part: str, stuck: bool) -> None:
        """Block an axis, or release it; ``part`` is named as in :class:`~stagewire_virtual.instrument.Row`.

        Raises :class:`~stagewire_virtual.errors.UnknownPartError` for a part that does not exist or does not
        move.
        """
        moving = {name: each for name, each in self._channels.items() if each.behaviour.can_stick}
        if part not in moving:
            raise UnknownPartError(f"{part} that can stick", list(moving))
        moving[part].stuck = stuck

    @property
    def units(self) -> Sequence[Unit]:
        """The unit, and the unit of each channel, which is its module in a rack of modules."""
        return [self.unit, *(channel.unit for channel in self.channels)]

    @property
    def channels(self) -> tuple[Channel, ...]:
        """All channels, for a rack bay by bay."""
        return tuple(self._channels.values())

    def channel(self, number: int, bay: int = 1) -> Channel:
        """Return the channel with a number, for a rack in a bay; both are counted from 1.

        Raises :class:`~stagewire_virtual.errors.UnknownPartError` if it does not exist.
        """
        where = "" if bay == 1 and "" in self._controllers else f"bay {bay}, "
        return self._channel(f"{where}channel {number}")

    def user_io(self, bay: int | None = None) -> UserIo:
        """Return the digital inputs and outputs in a bay, from 1; without it, of the unit or motherboard.

        Raises :class:`~stagewire_virtual.errors.UnknownPartError` for an empty or unknown bay.
        """
        if bay not in self._user_io:
            known = [f"bay {known}" for known in self._user_io if known is not None]
            raise UnknownPartError(f"bay {bay}", known)
        return self._user_io[bay]

    def _channel(self, name: str) -> Channel:
        if name not in self._channels:
            raise UnknownPartError(name, list(self._channels))
        return self._channels[name]


def rack_of(
    units: Sequence[Unit | None], clock: Clock, options: Options = _DEFAULT
) -> AptInstrument:
    """Return a rack with the given module in each bay; None is an empty bay.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for units that are not modules, for too many
    bays, and for options that the rack does not support.
    """
    modules = [unit for unit in units if unit is not None]
    for unit in modules:
        if not _is_module(unit.facts):
            every = units_of(unit.protocol, unit.registry).values()
            known = [
                one.name
                for one in every
                if _is_module(one.facts) and not AptInstrument.why_not(one)
            ]
            raise BadOptionError(
                f"{unit.name} is not a module of a rack (modules: {', '.join(known)})"
            )
    if len(units) > BAYS:
        raise BadOptionError(f"a rack has at most {BAYS} bays, not {len(units)}")
    registry = modules[0].registry if modules else PROTOCOL.registry()
    protocol = modules[0].protocol if modules else PROTOCOL
    return AptInstrument(modular_rack(protocol, registry, len(units)), clock, options, units)


def _idents(unit: Unit, channels: int) -> Sequence[int]:
    """Return the values of the channels of a unit in messages."""
    if "channel_idents" not in unit.facts:
        return range(1, channels + 1)
    values = unit.registry["enumerations"][unit.facts["channel_idents"]]["values"].values()
    return sorted(entry["value"] for entry in values)[:channels]


def _with_built_in(settings: Settings, unit: Unit) -> Settings:
    """Return the settings with the stage that is built into a unit, unless they have another."""
    name = unit.facts.get("built_in")
    if name is None or settings.stage is not None:
        return settings
    [stage] = find_stages(unit.protocol.package, name)
    return replace(settings, stage=stage)


def _is_module(facts: Mapping[str, Any]) -> bool:
    return facts.get("address") == "bay"


def _check_bays(empty: Iterable[int], bays: int, unit: Unit) -> None:
    for bay in sorted(empty):
        if not 1 <= bay <= bays:
            there = f"bays are 1 to {bays}" if bays else "it has no bays"
            raise BadOptionError(f"{unit.name} has no bay {bay} ({there})")
