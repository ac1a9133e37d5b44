"""Options of ``stagewire decode`` that choose the protocol, the direction and the message."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from stagewire.capture import Heading
from stagewire.protocols import (
    CommandProtocol,
    FramedProtocol,
    Protocol,
)
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.formats.task import Task
from stagewire_cli.framings import framing_of
from stagewire_cli.framings.framing import Options
from stagewire_cli.protocols import choose, choose_by_message
from stagewire_conformance.framings import codec_of


@dataclass(frozen=True)
class Selection(Options):
    """The options that select the protocol, direction and message, as given."""

    def task(self) -> Task:
        """Return the decoding task. Raises :class:`CalledWronglyError` for invalid options."""
        if self.recorded:
            task = self._of_capture(self.recorded)._task()
            task.records()
            return task
        return self._task()

    def _of_capture(self, recorded: Heading) -> Selection:
        """Return these options combined with a capture; raise if one contradicts it."""
        for option, value in (("--direction", self.direction), ("--command", self.command)):
            if value is not None:
                raise CalledWronglyError(
                    f"{option} does not apply to a capture, which contains the direction of all bytes"
                )
        if self.protocol not in (None, recorded.protocol):
            raise CalledWronglyError(
                f"--protocol {self.protocol} contradicts the capture, which is of {recorded.protocol}"
            )
        named = {text.partition("=")[0] for text in self.contexts}
        status = self.status or (None if "status" in named else _status(recorded))
        added = [f"{name}={value}" for name, value in _contexts(recorded) if name not in named]
        return replace(
            self, protocol=recorded.protocol, status=status, contexts=(*self.contexts, *added)
        )

    def _task(self) -> Task:
        protocol = self._protocol()
        framing = framing_of(protocol)
        if framing is not None:
            return framing.task(self)
        raise CalledWronglyError(
            f"{protocol.name}: this command cannot decode protocols of the class "
            f"{type(protocol).__name__}"
        )

    def _protocol(self) -> Protocol:
        """Return the protocol that the options select; by default one of frames."""
        named = {"--command": self.command, "--message": (self.message or "").partition(":")[0]}
        for option, name in named.items():
            if name:
                try:
                    return choose_by_message(self.protocol, name)
                except CalledWronglyError as error:
                    raise CalledWronglyError(f"{option}: {error}") from None
        kind = FramedProtocol if self.direction is None else CommandProtocol
        return choose(self.protocol, lambda protocol: isinstance(protocol, kind))


def _contexts(recorded: Heading) -> Iterator[tuple[str, str]]:
    """Yield the other contexts of the unit of a capture, unless they depend on its firmware."""
    protocol = choose(recorded.protocol, lambda _: True)
    known = codec_of(protocol).contexts
    for unit in protocol.registry()["units"]:
        for name, value in unit.get("contexts", {}).items():
            if unit["name"] == recorded.unit and isinstance(value, str) and name in known:
                yield name, value


def _status(recorded: Heading) -> str | None:
    """Return the status block that the unit of a capture sends, if the decoder depends on it."""
    protocol = choose(recorded.protocol, lambda _: True)
    known = codec_of(protocol).contexts.get("status", ())
    units = protocol.registry()["units"]
    found = (unit.get("status") for unit in units if unit["name"] == recorded.unit)
    return next((status for status in found if status in known), None)
