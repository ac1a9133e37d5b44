"""How the USB plug of a controller looks, by protocol.

No document that a registry was made from gives these numbers; where each comes from stands beside it.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["FTDI", "PLUGS", "Plug", "plug_of"]

FTDI = 0x0403
"""The vendor of the USB chip inside the controllers; its ids are on many other things, too."""


@dataclass(frozen=True, slots=True)
class Plug:
    """A USB device that is a controller of one protocol.

    :param protocol: the protocol that it speaks.
    :param vid: id of the vendor.
    :param pid: id of the product.
    :param manufacturer: what its manufacturer's name contains; with it, other products of ``vid`` fit, too.
    :param source: where the numbers come from.
    """

    protocol: str
    vid: int
    pid: int
    manufacturer: str
    source: str


PLUGS = (
    Plug(
        protocol="thorlabs_apt",
        vid=FTDI,
        pid=0xFAF0,
        manufacturer="thorlabs",
        source="ftdi_sio_ids.h of the Linux kernel, FTDI_THORLABS_PID: ThorLabs USB motor drivers",
    ),
)


def plug_of(vid: int | None, pid: int | None, manufacturer: str = "") -> Plug | None:
    """Return what a USB device is the plug of, or None for anything else.

    A chip that kept the ids of its own vendor (0403:6001) may be in any adapter: it is taken for a
    controller only where the name of the manufacturer says so.
    """
    for plug in PLUGS:
        if vid == plug.vid and (pid == plug.pid or plug.manufacturer in manufacturer.lower()):
            return plug
    return None
