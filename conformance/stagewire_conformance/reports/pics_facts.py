"""The declaration of a controller (PICS) as facts of a sheet."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict

from stagewire_conformance.device.pics import ChannelPics, Pics
from stagewire_conformance.reports.model import Fact


def certificate_facts(pics: Pics) -> Iterator[Fact]:
    """Yield the lines that identify the controller and the tester, without those that are not stated."""
    for name, value in asdict(pics.certificate).items():
        if value:
            yield Fact(key=f"certificate_{name}", label=name.capitalize(), value=value)


def pics_facts(pics: Pics) -> tuple[Fact, ...]:
    """Return the contents of a PICS from a file; empty without a file."""
    return tuple(_facts(pics)) if pics.digest else ()


def _facts(pics: Pics) -> Iterator[Fact]:
    yield Fact(key="unit", label="Unit", value=pics.unit)
    if pics.protocol:
        yield Fact(key="protocol", label="Protocol", value=pics.protocol)
    yield Fact(key="line", label="Line type", value=pics.line)
    if pics.issue:
        yield Fact(key="issue", label="Issue of the document", value=pics.issue)
    if pics.firmware:
        yield Fact(key="firmware", label="Firmware", value=pics.firmware)
    if not pics.motherboard:
        yield Fact(key="motherboard", label="Motherboard", value="none")
    for bay in pics.bays or ():
        yield Fact(key=f"bay_{bay.number}", label=f"Bay {bay.number}", value=bay.unit or "card")
        yield from _unsupported(f"Unsupported in bay {bay.number}", bay.unsupported)
    for channel in pics.channels:
        name = _name(channel)
        yield Fact(key=f"channel_{name}", label=name.capitalize(), value=_stage(channel))
    if pics.timing.reply_p99_ms is not None:
        limit = f"99 of 100 within {pics.timing.reply_p99_ms:g} ms"
        yield Fact(key="reply_p99_ms", label="Replies", value=limit)
    yield from _unsupported("Unsupported", pics.unsupported)


def _unsupported(label: str, reasons: Mapping[str, str]) -> Iterator[Fact]:
    """Yield the unsupported messages by reason."""
    found: dict[str, list[str]] = {}
    for message, reason in reasons.items():
        found.setdefault(reason, []).append(message)
    for reason, messages in found.items():
        yield Fact(
            key=f"{label}: {reason}", label=f"{label}: {reason}", value=", ".join(sorted(messages))
        )


def _name(channel: ChannelPics) -> str:
    if channel.axis:
        return f"axis {channel.axis}"
    bay = f"bay {channel.bay}, " if channel.bay else ""
    return f"{bay}channel {channel.number}"


def _stage(channel: ChannelPics) -> str:
    scale = f"{channel.counts_per_mm} counts per mm" if channel.counts_per_mm else ""
    return "; ".join(
        filter(
            None,
            (
                channel.stage or scale or "stage not stated",
                f"travel {channel.travel}" if channel.travel else "travel not stated",
                "homes" if channel.homes else "does not home",
                "limit switches" if channel.limit_switches else "no limit switches",
            ),
        )
    )
