"""A message without a documented layout, and Thorlabs APT with it; the package need not have one."""

from __future__ import annotations

from stagewire.protocols import Direction, FramedProtocol, Layout, UndocumentedMessage
from stagewire_apt import PROTOCOL as APT

NAME = "HW_UNPRINTED"


class HwUnprinted(UndocumentedMessage):
    """An unsolicited message, as the generator makes it for a message without a layout."""

    __slots__ = ()
    layout = Layout(
        NAME,
        id=0x00F1,
        direction=Direction.TO_HOST,
        form="undocumented",
        fields=("data", "param1", "param2"),
        optional=("param1", "param2"),
        unnamed=("param1", "param2"),
        unsolicited=True,
    )


PROTOCOL = FramedProtocol(
    APT.name,
    APT.title,
    APT.package,
    (*APT.messages, HwUnprinted),
    host=APT.host,
    devices=APT.devices,
    nameless=APT.nameless,
    channel=APT.channel,
    faults={**APT.faults, HwUnprinted.layout.id: APT.faults[0x0081]},
    aliases=APT.aliases,
)
