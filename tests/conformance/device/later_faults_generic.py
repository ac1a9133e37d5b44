"""Faults that each new family can have: sub-messages, statuses, updates, keep-alive, byte order."""

from __future__ import annotations

from collections.abc import Callable

from faulty_apt_link import IDS, Change, LinkFault, of
from later_faults import F, byte, cut, dropped, flip, reversed_bytes, says, takes, twice

_LASER, _TEC, _QUAD = (IDS[f"{group}_GET_STATUSBITS"] for group in ("LA", "TEC", "QUAD"))
_PZMOT = IDS["PZMOT_GET_LIMSWITCHPARAMS"]


def sub(id: int, number: int, change: Change) -> Callable[[], LinkFault]:
    """Change the messages from the controller with an id and a sub-message."""

    def selected(raw: bytes) -> bytes:
        return (
            change(raw)
            if raw[:2] + raw[6:8] == id.to_bytes(2, "little") + bytes((number, 0))
            else raw
        )

    return lambda: LinkFault(to_host=selected)


def every_third(name: str) -> Callable[[], LinkFault]:
    """Send only every third of some messages."""

    def make() -> LinkFault:
        count = [0]

        def change(raw: bytes) -> bytes:
            count[0] += 1
            return raw if count[0] % 3 == 0 else b""

        return LinkFault(to_host=of(name, change))

    return make


_LD, _LA, _TECS = "LD_GET_STATUSUPDATE", "LA_GET_STATUSUPDATE", "TEC_GET_STATUSUPDATE"
_NT, _QD = "PZ_GET_NTSTATUSUPDATE", "QUAD_GET_STATUSUPDATE"
_A, _U = ("answers",), ("updates",)

GENERIC = (
    F(
        "A KLD101 answers for its status bits with the sub-message of the limits",
        "KLD101 TLD001",
        sub(_LASER, 7, byte(6, 9)),
        _A,
        "laser-sub-message-returned",
    ),
    F(
        "A KIM101 answers for its limit switches with another sub-message",
        "KIM101",
        sub(_PZMOT, 11, byte(6, 7)),
        _A,
        "pzmot-reply-sub-message",
    ),
    F(
        "A TTC001 answers for its status bits with another sub-message",
        "TTC001",
        sub(_TEC, 7, byte(6, 5)),
        _A,
        "tec-reply-sub-message",
    ),
    F(
        "A KPA101 answers for its status bits with another sub-message",
        "KPA101",
        sub(_QUAD, 9, byte(6, 5)),
        _A,
        "quad-reply-sub-message",
    ),
    F(
        "The set point of a KLS635 lacks its last byte",
        "KLS635 TLS001",
        sub(_LASER, 1, cut(3)),
        _A,
        "data-length-bytes",
    ),
    F(
        "The set point of a TTC001 lacks its last byte",
        "TTC001",
        sub(_TEC, 1, cut(3)),
        _A,
        "data-length-bytes",
    ),
    F(
        "A TTC001 does not answer for its loop",
        "TTC001",
        sub(_TEC, 9, dropped),
        _A,
        "request-answered",
    ),
    F(
        "A KLD101 answers twice for its status bits",
        "KLD101",
        sub(_LASER, 7, twice),
        _A,
        "get-answers-request",
    ),
    F(
        "A KLD101 answers twice with its status",
        "KLD101",
        says(_LD, twice),
        _A,
        "laser-status-each-request",
    ),
    F(
        "A KNA101 answers twice with its status",
        "KNA101",
        says(_NT, twice),
        _A,
        "nanotrak-status-each-request",
    ),
    F(
        "A KPA101 answers from another address",
        "KPA101",
        sub(_QUAD, 9, byte(5, 0x22)),
        _A,
        "reply-addresses-swapped",
    ),
    F(
        "A KLD101 reports another output in its status",
        "KLD101 TLD001",
        says(_LD, flip(-4, 0x01)),
        ("status",),
        "status-bits-same",
    ),
    F(
        "A TTC001 reports another output in its status",
        "TTC001",
        says(_TECS, flip(-4, 0x01)),
        ("status",),
        "status-bits-same",
    ),
    F(
        "A KLD101 sends a third of its status updates",
        "KLD101 TLD001",
        every_third(_LD),
        _U,
        "status-updates-every-100-ms",
    ),
    F(
        "A TTC001 sends a third of its status updates",
        "TTC001",
        every_third(_TECS),
        _U,
        "status-updates-every-100-ms",
    ),
    F(
        "A KNA101 sends a third of its status updates",
        "KNA101 TNA001",
        every_third(_NT),
        _U,
        "status-updates-every-100-ms",
    ),
    F(
        "A KPA101 sends a third of its status updates",
        "KPA101 TPA101",
        every_third(_QD),
        _U,
        "status-updates-every-100-ms",
    ),
    F(
        "A KNA101 does not stop its status updates",
        "KNA101",
        takes("HW_STOP_UPDATEMSGS", dropped),
        _U,
        "updates-stop",
    ),
    F(
        "A TLS001 ignores keep-alive messages",
        "TLS001 KLS635",
        takes("LA_ACK_STATUSUPDATE", dropped),
        ("keep-alive",),
        "laser-keep-alive",
    ),
    F(
        "A TTC001 ignores keep-alive messages",
        "TTC001",
        takes("TEC_ACK_STATUSUPDATE", dropped),
        ("keep-alive",),
        "tec-keep-alive",
    ),
    F(
        "A KPA101 ignores keep-alive messages",
        "KPA101",
        takes("QUAD_ACK_STATUSUPDATE", dropped),
        ("keep-alive",),
        "quad-keep-alive",
    ),
    F(
        "A KNA101 sends its gain in the other byte order",
        "KNA101",
        says("PZ_GET_NTGAINPARAMS", reversed_bytes(8, 2)),
        ("answers", "readback"),
        "format-sizes",
    ),
)
