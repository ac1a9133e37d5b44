"""The one module of the runtime that generated packages import.

:data:`VERSION` counts its incompatible changes. A generated package states the version that it was made for
(:func:`require`). A runtime with another version refuses to load the package and says what to do. Within a
version, names are only added. See ``docs/reference/versioning.md`` for how long a version is supported.

A name is imported on first use, so a package of messages does not load sessions or device classes. The names
of device classes for asyncio begin with ``Async`` here; a package imports them without this prefix.
"""

from __future__ import annotations

from stagewire._lazy import lazy
from stagewire.errors import SupportVersionError

TYPE_CHECKING: bool = False
if TYPE_CHECKING:
    from typing import Final

    from stagewire._codec.flags import Bit, Enumeration, Flags
    from stagewire._codec.message import (
        Direction,
        Layout,
        Message,
        check_bytes,
        check_integer,
        check_text,
    )
    from stagewire._devices.asynchronous.devices import AxesDevice as AsyncAxesDevice
    from stagewire._devices.asynchronous.devices import ChannelsDevice as AsyncChannelsDevice
    from stagewire._devices.asynchronous.devices import Device as AsyncDevice
    from stagewire._devices.asynchronous.devices import ModuleDevice as AsyncModuleDevice
    from stagewire._devices.asynchronous.devices import PositionsDevice as AsyncPositionsDevice
    from stagewire._devices.asynchronous.devices import RackDevice as AsyncRackDevice
    from stagewire._devices.asynchronous.devices import (
        SingleChannelDevice as AsyncSingleChannelDevice,
    )
    from stagewire._devices.asynchronous.devices import (
        SingleChannelModule as AsyncSingleChannelModule,
    )
    from stagewire._devices.asynchronous.parts import Axis as AsyncAxis
    from stagewire._devices.asynchronous.parts import Bay as AsyncBay
    from stagewire._devices.asynchronous.parts import Channel as AsyncChannel
    from stagewire._devices.asynchronous.parts import ChannelsBay as AsyncChannelsBay
    from stagewire._devices.asynchronous.parts import Motion as AsyncMotion
    from stagewire._devices.asynchronous.parts import Mover as AsyncMover
    from stagewire._devices.asynchronous.parts import Part as AsyncPart
    from stagewire._devices.asynchronous.parts import Stoppable as AsyncStoppable
    from stagewire._devices.scales import ByCase, BySetting, ByStage, ByUnit, Rule
    from stagewire._devices.synchronous.devices import (
        AxesDevice,
        ChannelsDevice,
        Device,
        ModuleDevice,
        PositionsDevice,
        RackDevice,
        SingleChannelDevice,
        SingleChannelModule,
    )
    from stagewire._devices.synchronous.parts import (
        Axis,
        Bay,
        Channel,
        ChannelsBay,
        Motion,
        Mover,
        Part,
        Stoppable,
    )
    from stagewire._devices.tables import (
        Action,
        Given,
        MotionEnd,
        Order,
        ParameterSet,
        Poll,
        Query,
        Reported,
        Stored,
    )
    from stagewire._devices.tables import Command as DeviceCommand
    from stagewire._devices.unit import (
        Alias,
        Enabling,
        Facts,
        Hindrance,
        Need,
        Positions,
        Setting,
        StageReport,
        Told,
        Unit,
        Unsupported,
    )
    from stagewire._devices.values import (
        Bits,
        BitsByUnit,
        InUnits,
        Named,
        NamedByUnit,
        Raw,
        RawBytes,
        RawIntegers,
        RawText,
        Real,
        Values,
    )
    from stagewire._framings.header.counted import Counted, CountedMessage
    from stagewire._framings.header.message import (
        FramedMessage,
        UndecidedMessage,
        UndocumentedMessage,
        check_addresses,
    )
    from stagewire._framings.header.protocol import FramedProtocol
    from stagewire._framings.header.table import FaultPlaces
    from stagewire._framings.packet.packet import PacketMessage
    from stagewire._framings.packet.protocol import PacketProtocol
    from stagewire._framings.packet.shape import Crc, Shape, Sum, Xor
    from stagewire._framings.slots.command import Command, Reply, SetupCommand
    from stagewire._framings.slots.protocol import CommandProtocol
    from stagewire._sessions.options import Ends
    from stagewire.quantities import (
        EndlessTravel,
        Limit,
        Number,
        Scale,
        ScaleConflict,
        Stage,
        UnknownLimit,
        UnknownScale,
    )

__all__ = [
    "VERSION",
    "Action",
    "Alias",
    "AsyncAxesDevice",
    "AsyncAxis",
    "AsyncBay",
    "AsyncChannel",
    "AsyncChannelsBay",
    "AsyncChannelsDevice",
    "AsyncDevice",
    "AsyncModuleDevice",
    "AsyncMotion",
    "AsyncMover",
    "AsyncPart",
    "AsyncPositionsDevice",
    "AsyncRackDevice",
    "AsyncSingleChannelDevice",
    "AsyncSingleChannelModule",
    "AsyncStoppable",
    "AxesDevice",
    "Axis",
    "Bay",
    "Bit",
    "Bits",
    "BitsByUnit",
    "ByCase",
    "BySetting",
    "ByStage",
    "ByUnit",
    "Channel",
    "ChannelsBay",
    "ChannelsDevice",
    "Command",
    "CommandProtocol",
    "Counted",
    "CountedMessage",
    "Crc",
    "Device",
    "DeviceCommand",
    "Direction",
    "Enabling",
    "EndlessTravel",
    "Ends",
    "Enumeration",
    "Facts",
    "FaultPlaces",
    "Flags",
    "FramedMessage",
    "FramedProtocol",
    "Given",
    "Hindrance",
    "InUnits",
    "Layout",
    "Limit",
    "Message",
    "ModuleDevice",
    "Motion",
    "MotionEnd",
    "Mover",
    "Named",
    "NamedByUnit",
    "Need",
    "Number",
    "Order",
    "PacketMessage",
    "PacketProtocol",
    "ParameterSet",
    "Part",
    "Poll",
    "Positions",
    "PositionsDevice",
    "Query",
    "RackDevice",
    "Raw",
    "RawBytes",
    "RawIntegers",
    "RawText",
    "Real",
    "Reply",
    "Reported",
    "Rule",
    "Scale",
    "ScaleConflict",
    "Setting",
    "SetupCommand",
    "Shape",
    "SingleChannelDevice",
    "SingleChannelModule",
    "Stage",
    "StageReport",
    "Stoppable",
    "Stored",
    "Sum",
    "Told",
    "UndecidedMessage",
    "UndocumentedMessage",
    "Unit",
    "UnknownLimit",
    "UnknownScale",
    "Unsupported",
    "Values",
    "Xor",
    "check_addresses",
    "check_bytes",
    "check_integer",
    "check_text",
    "require",
]

VERSION: Final = 1
"""The version of this module."""

if not TYPE_CHECKING:  # otherwise type checkers would accept any name
    __getattr__, __dir__ = lazy(
        __name__,
        {
            "_codec.message": "Direction Layout Message check_bytes check_integer check_text",
            "_codec.flags": "Bit Enumeration Flags",
            "_framings.header.message": (
                "FramedMessage UndecidedMessage UndocumentedMessage check_addresses"
            ),
            "_framings.header.counted": "Counted CountedMessage",
            "_framings.header.table": "FaultPlaces",
            "_framings.header.protocol": "FramedProtocol",
            "_framings.slots.command": "Command Reply SetupCommand",
            "_framings.slots.protocol": "CommandProtocol",
            "_framings.packet.shape": "Crc Shape Sum Xor",
            "_framings.packet.packet": "PacketMessage",
            "_framings.packet.protocol": "PacketProtocol",
            "_devices.values": (
                "Bits BitsByUnit InUnits Named NamedByUnit Raw RawBytes RawIntegers RawText Real Values"
            ),
            "_devices.tables": (
                "Action Command=DeviceCommand Given MotionEnd Order ParameterSet Poll Query Reported "
                "Stored"
            ),
            "_devices.scales": "ByCase BySetting ByStage ByUnit Rule",
            "_devices.unit": (
                "Alias Enabling Facts Hindrance Need Positions Setting StageReport Told Unit Unsupported"
            ),
            "_sessions.options": "Ends",
            "quantities": (
                "EndlessTravel Limit Number Scale ScaleConflict Stage UnknownLimit UnknownScale"
            ),
            "_devices.synchronous.devices": (
                "AxesDevice ChannelsDevice Device ModuleDevice PositionsDevice RackDevice "
                "SingleChannelDevice SingleChannelModule"
            ),
            "_devices.synchronous.parts": "Axis Bay Channel ChannelsBay Motion Mover Part Stoppable",
            "_devices.asynchronous.devices": (
                "AxesDevice=AsyncAxesDevice ChannelsDevice=AsyncChannelsDevice "
                "Device=AsyncDevice ModuleDevice=AsyncModuleDevice "
                "PositionsDevice=AsyncPositionsDevice RackDevice=AsyncRackDevice "
                "SingleChannelDevice=AsyncSingleChannelDevice "
                "SingleChannelModule=AsyncSingleChannelModule"
            ),
            "_devices.asynchronous.parts": (
                "Axis=AsyncAxis Bay=AsyncBay Channel=AsyncChannel ChannelsBay=AsyncChannelsBay "
                "Motion=AsyncMotion Mover=AsyncMover Part=AsyncPart "
                "Stoppable=AsyncStoppable"
            ),
        },
    )


def require(version: int) -> None:
    """Raise :class:`~stagewire.errors.SupportVersionError` if a package requires another version.

    Generated packages call this function when they are loaded.
    """
    if version != VERSION:
        raise SupportVersionError(
            f"this package requires version {version} of stagewire.support, but the installed stagewire "
            f"has version {VERSION}; "
            f"{'upgrade stagewire' if version > VERSION else 'generate the package again'}"
        )
