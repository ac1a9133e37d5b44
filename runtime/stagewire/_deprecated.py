"""Module paths of 0.1 that have moved: importable for one release, with a DeprecationWarning.

Only :data:`MOVED` lists these paths. It maps each old path below ``stagewire`` to the public module to use
instead, followed by private modules that define names no longer public.
"""

from __future__ import annotations

import sys

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType
    from typing import Any

MOVED = {
    "candidates": "stagewire.devices stagewire._devices.candidates",
    "closing": "stagewire.links",
    "columns.gathering": "stagewire.columns",
    "columns.reading": "stagewire.columns stagewire._columns.arrays",
    "columns.shape": "stagewire.columns",
    "columns.standard": "stagewire.columns stagewire._columns.arrays",
    "columns.vectors": "stagewire.columns stagewire._columns.vectors",
    "commands": (
        "stagewire.protocols "
        "stagewire._framings.slots.frame "
        "stagewire._framings.slots.framer "
        "stagewire._framings.slots.command "
        "stagewire._framings.slots.replies"
    ),
    "commands.command": "stagewire.protocols",
    "commands.events": "stagewire.framing",
    "commands.formats": "stagewire.framing stagewire._framings.slots.streams",
    "commands.frame": "stagewire.protocols stagewire._framings.slots.frame",
    "commands.framer": "stagewire.framing",
    "commands.marks": "stagewire.protocols stagewire._framings.slots.command",
    "commands.overheard": "stagewire.framing",
    "commands.prefix": "stagewire.protocols stagewire._framings.slots.frame",
    "commands.protocol": "stagewire.protocols",
    "commands.refusals": "stagewire.protocols stagewire._framings.slots.protocol",
    "commands.replies": "stagewire.framing stagewire._framings.slots.replies",
    "commands.rule": (
        "stagewire.framing stagewire._framings.slots.command stagewire._framings.slots.framer"
    ),
    "devices.arrival": "stagewire.devices stagewire._devices.asynchronous.targets",
    "devices.asynchronous": (
        "stagewire.devices "
        "stagewire._devices.asynchronous.devices "
        "stagewire._devices.asynchronous.parts "
        "stagewire._devices.opening"
    ),
    "devices.asynchronous_parts": "stagewire.devices stagewire._devices.asynchronous.parts",
    "devices.awaited": (
        "stagewire.devices stagewire._devices.asynchronous.transport stagewire._devices.opening"
    ),
    "devices.calls": "stagewire.devices stagewire._devices.asynchronous.calls",
    "devices.connection": "stagewire.devices stagewire._devices.connection",
    "devices.describing": "stagewire.devices stagewire._devices.structure",
    "devices.diagnosis": "stagewire.devices stagewire._devices.asynchronous.motion",
    "devices.giving": "stagewire.devices stagewire._devices.arguments",
    "devices.identity": "stagewire.devices stagewire._devices.identity",
    "devices.immediate": "stagewire.devices stagewire._devices.synchronous.transport",
    "devices.limits": "stagewire.devices stagewire._devices.limits stagewire._devices.travel",
    "devices.line": (
        "stagewire.devices "
        "stagewire._devices.endpoint "
        "stagewire._devices.connection "
        "stagewire._devices.asynchronous.transport"
    ),
    "devices.modes": "stagewire.devices stagewire._devices.asynchronous.devices",
    "devices.motions": "stagewire.devices stagewire._devices.motions stagewire._sessions.motions",
    "devices.moving": "stagewire.devices stagewire._devices.asynchronous.motion",
    "devices.opening": (
        "stagewire.devices stagewire._devices.asynchronous.handshake stagewire._devices.unit"
    ),
    "devices.options": "stagewire.devices stagewire._devices.options",
    "devices.scales": "stagewire.devices stagewire._devices.scales",
    "devices.spot": "stagewire.devices stagewire._devices.endpoint",
    "devices.structure": "stagewire.devices stagewire._devices.structure",
    "devices.synchronous": (
        "stagewire.devices "
        "stagewire._devices.synchronous.devices "
        "stagewire._devices.synchronous.parts"
    ),
    "devices.synchronous_parts": "stagewire.devices stagewire._devices.synchronous.parts",
    "devices.tables": "stagewire.devices stagewire._devices.tables stagewire._sessions.options",
    "devices.targets": "stagewire.devices stagewire._devices.asynchronous.targets",
    "devices.unasked": "stagewire.devices stagewire._devices.event_filter",
    "devices.unit": "stagewire.devices stagewire._devices.unit",
    "devices.values": "stagewire.devices stagewire._devices.values",
    "direction": "stagewire.protocols",
    "discovery.asking": "stagewire.discovery stagewire._discovery.identification",
    "discovery.computer_diagnosis": "stagewire.discovery",
    "discovery.diagnosis": "stagewire.discovery",
    "discovery.finding": "stagewire.discovery stagewire._discovery.search",
    "discovery.found": "stagewire.discovery",
    "discovery.known": (
        "stagewire.discovery stagewire._discovery.products stagewire._codec.protocol"
    ),
    "discovery.line_diagnosis": "stagewire.discovery",
    "discovery.linux": "stagewire.discovery stagewire._discovery.ports",
    "discovery.opening": "stagewire.discovery stagewire._discovery.opening",
    "discovery.ports": "stagewire.discovery stagewire._discovery.ports",
    "discovery.usb": "stagewire.discovery stagewire._discovery.ports",
    "discovery.windows": "stagewire.discovery stagewire._discovery.ports",
    "faults": "stagewire.support stagewire._framings.header.table",
    "flags": "stagewire.protocols",
    "frame": "stagewire.protocols",
    "framed": "stagewire.protocols",
    "framed_message": "stagewire.protocols stagewire._framings.header.message",
    "framing.events": "stagewire.framing stagewire._codec.events stagewire._framings.header.frame",
    "framing.framer": "stagewire.framing",
    "framing.rule": "stagewire.framing stagewire._framings.header.framer",
    "framing.table": "stagewire.framing stagewire._codec.message",
    "frozen": "stagewire.protocols stagewire._codec.events",
    "header": "stagewire.protocols",
    "links.async_descriptor": "stagewire.links stagewire._links.async_descriptor",
    "links.async_pumped": "stagewire.links stagewire._links.pumped",
    "links.async_tcp": "stagewire.links stagewire._links.async_descriptor",
    "links.descriptor": "stagewire.links stagewire._links.descriptor",
    "links.link": "stagewire.links stagewire._links.link",
    "links.loss": "stagewire.links stagewire._links.link",
    "links.opening": "stagewire.links",
    "links.ports": "stagewire.links stagewire._links.serial_port",
    "links.pump": "stagewire.links stagewire._links.pumped",
    "links.pumped": "stagewire.links stagewire._links.pumped",
    "links.readiness": "stagewire.links stagewire._links.descriptor",
    "links.refusal": "stagewire.links stagewire._links.serial_port",
    "links.serial_lines": "stagewire.links stagewire._links.serial_link",
    "links.serial_port": "stagewire.links stagewire._links.serial_port",
    "links.settings": "stagewire.links",
    "links.tcp": "stagewire.links stagewire._links.tcp",
    "links.tcp_address": "stagewire.links stagewire._links.tcp",
    "message": "stagewire.protocols stagewire._codec.message",
    "packets": (
        "stagewire.protocols stagewire._framings.packet.packet stagewire._framings.packet.framer"
    ),
    "packets.checks": "stagewire.protocols",
    "packets.events": "stagewire.framing",
    "packets.framer": "stagewire.framing",
    "packets.layouts": "stagewire.protocols stagewire._framings.packet.framer",
    "packets.message": "stagewire.protocols",
    "packets.packet": "stagewire.protocols stagewire._framings.packet.packet",
    "packets.protocol": "stagewire.protocols",
    "packets.refusals": "stagewire.protocols stagewire._framings.packet.protocol",
    "packets.shape": "stagewire.protocols",
    "protocol": "stagewire.protocols stagewire._codec.protocol",
    "session": "stagewire.sessions",
    "session.asynchronous": "stagewire.sessions",
    "session.awaiting": "stagewire.sessions stagewire._sessions.awaiting",
    "session.calling": "stagewire.sessions stagewire._sessions.calling",
    "session.commands": "stagewire.sessions",
    "session.core": "stagewire.sessions stagewire._sessions.core",
    "session.driver": "stagewire.sessions stagewire._sessions.driver",
    "session.exchange": "stagewire.sessions stagewire._sessions.exchange",
    "session.framed": "stagewire.sessions",
    "session.framed_exchanges": "stagewire.sessions stagewire._sessions.framed_exchanges",
    "session.hearing": "stagewire.sessions stagewire._sessions.receiver",
    "session.interrupts": "stagewire.sessions stagewire._sessions.interrupts",
    "session.keep_alive": "stagewire.sessions stagewire._sessions.send_queue",
    "session.lines": "stagewire.sessions stagewire._sessions.command_exchanges",
    "session.loop_driver": "stagewire.sessions stagewire._sessions.loop_driver",
    "session.matching": "stagewire.sessions stagewire._sessions.matching",
    "session.motions": "stagewire.sessions stagewire._sessions.motions",
    "session.news": "stagewire.sessions stagewire._sessions.dispatch",
    "session.options": "stagewire.sessions",
    "session.outgoing": "stagewire.sessions stagewire._sessions.send_queue",
    "session.recording": "stagewire.sessions",
    "session.requests": "stagewire.sessions stagewire._sessions.requests",
    "session.statistics": "stagewire.sessions",
    "session.subscribing": "stagewire.sessions stagewire._sessions.subscriptions",
    "session.subscription": "stagewire.sessions stagewire._sessions.dispatch",
    "session.synchronous": "stagewire.sessions",
    "session.termination": "stagewire.sessions stagewire._sessions.termination",
    "session.thread_driver": "stagewire.sessions stagewire._sessions.thread_driver",
    "session.waiting": "stagewire.sessions stagewire._sessions.waiters",
    "session.wording": "stagewire.sessions stagewire._sessions.error_texts",
}
"""Path in 0.1 below ``stagewire`` -> public module to use, then private modules with its other names."""

RENAMED = {
    "commands.overheard.Asking": "HostListener",
    "commands.overheard.Replies": "ReplyListener",
    "devices.awaited.CommandLine": "CommandTransport",
    "devices.awaited.FramedLine": "FramedTransport",
    "devices.calls.ask": "query",
    "devices.immediate.CommandLine": "CommandTransport",
    "devices.immediate.FramedLine": "FramedTransport",
    "devices.line.Line": "Transport",
    "devices.line.LineOfFrames": "FramedTransport",
    "devices.spot.Spot": "Endpoint",
    "devices.unasked.Unasked": "EventFilter",
    "discovery.asking.Heard": "Answers",
    "discovery.finding.asked": "identified",
    "discovery.known.protocols": "usable_protocols",
    "links.settings.LineSettings": "LinkSettings",
    "session.hearing.Hearing": "Receiver",
    "session.lines.Line": "CommandExchange",
    "session.news.News": "Dispatcher",
    "session.outgoing.Outgoing": "SendQueue",
    "session.wording.Wording": "ErrorTexts",
}
"""Name in 0.1, with its path -> current name."""


class _Finder:
    """Finder and loader of the old paths. It comes after all other finders, so it never hides a module."""

    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None,
        target: ModuleType | None = None,
    ) -> ModuleSpec | None:
        """Return the spec of an old path; None for every other name."""
        package, _, old = fullname.partition(".")
        if package != "stagewire" or old not in MOVED:
            return None
        from importlib.machinery import ModuleSpec

        # Some old paths were packages: mark all as packages, so that the paths below them are found.
        return ModuleSpec(fullname, self, is_package=True)  # type: ignore[arg-type]

    def create_module(self, spec: ModuleSpec) -> None:
        """Return None, so that Python creates an empty module."""

    def exec_module(self, module: ModuleType) -> None:
        """Warn, and look up each name in its new module on first use."""
        import warnings

        name = module.__name__
        old = name.partition(".")[2]
        public, *private = MOVED[old].split()
        warnings.warn(
            f"{name} has moved and will be removed in the next minor release: use {public}. "
            "If a generated package imports it, generate the package again",
            DeprecationWarning,
            stacklevel=2,
        )

        def moved(attribute: str) -> Any:
            now = RENAMED.get(f"{old}.{attribute}", attribute)
            for place in (*private, public):
                try:
                    return getattr(__import__(place, fromlist=[now]), now)
                except AttributeError:
                    pass
            raise AttributeError(f"module {name!r} has no attribute {attribute!r}")

        module.__getattr__ = moved  # type: ignore[method-assign]


def install() -> None:
    """Make the old paths importable, by a finder at the end of the list."""
    sys.meta_path.append(_Finder())
