"""``stagewire decode``: bytes to messages, for people or as JSON lines."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, BinaryIO

import typer
from rich.console import Console

from stagewire.errors import BadValueError, CodecError, DecodeError, UnknownMessageError
from stagewire.framing import End, Event
from stagewire.protocol import Protocol
from stagewire_cli.errors import WRONG, CalledWronglyError
from stagewire_cli.explain import explain
from stagewire_cli.hextext import parse_hex
from stagewire_cli.inputs import captures, chunks, is_json, opening
from stagewire_cli.progress import progress
from stagewire_cli.protocols import PROTOCOL_HELP, choose
from stagewire_cli.rendering import frame_line, frame_table, frame_title
from stagewire_cli.terminal import console
from stagewire_conformance.answers import frame_answer, refusal
from stagewire_conformance.codec import Codec, event_answer
from stagewire_conformance.hexes import spaced

__all__ = ["EXAMPLE", "decode"]

EXAMPLE = """\b
Examples:
  stagewire decode "53 04 06 00 D0 01 01 00 40 0D 03 00"
  stagewire decode capture.bin --end host --status dc --json
"""

Json = dict[str, Any]


def decode(
    source: Annotated[
        list[str],
        typer.Argument(metavar="HEX|FILE|-", help="Bytes in hex, a file, or - for stdin."),
    ],
    protocol: Annotated[str | None, typer.Option("--protocol", help=PROTOCOL_HELP)] = None,
    status: Annotated[
        str | None,
        typer.Option(
            "--status", help="Status block that the controller sends, such as dc or stepper."
        ),
    ] = None,
    end: Annotated[
        End | None,
        typer.Option("--end", help="End of the line that received the stream.  [default: none]"),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object per line.")] = False,
) -> None:
    """Decode one frame in hex, or a stream from a file or standard input.

    One frame on the command line must be whole and right; what is wrong with it is explained. A
    file holds hex text, raw bytes, or JSON captures ("hex" in each entry). Exit code 1 means
    that a frame was refused, or that a stream held garbage, a packet too short for its message, or
    an end that is incomplete.
    """
    chosen = choose(protocol)
    context = None if status is None else {"status": status}
    try:
        Codec(chosen).check_context(context)
    except BadValueError as error:
        raise CalledWronglyError(f"--status: {error}") from None
    shown = _Json(chosen, context) if as_json else _Text(chosen, context)
    right = _decode(source, shown, end)
    if not right:
        raise typer.Exit(WRONG)


def _decode(source: list[str], shown: _Json | _Text, end: End | None) -> bool:
    if source == ["-"]:
        return _read(sys.stdin.buffer, shown, end)
    if len(source) == 1 and _is_file(source[0]):
        with Path(source[0]).open("rb") as file:
            return _read(file, shown, end)
    for word in source:
        if word == "-" or (_is_file(word) and not _is_hex(word)):
            raise CalledWronglyError(
                f"{word} stands among other arguments; give one file at a time"
            )
    try:
        raw = parse_hex(" ".join(source))
    except ValueError as error:
        word = str(error).removeprefix("line 1: ")
        raise CalledWronglyError(f"neither a file nor hex: {word}") from None
    if end is not None:
        return _stream([raw], shown, end)
    return shown.frame(raw)


def _is_file(name: str) -> bool:
    try:
        return bool(name) and Path(name).exists()
    except (OSError, ValueError):  # too long, or a NUL: no name of a file
        return False


def _is_hex(word: str) -> bool:
    try:
        return bool(parse_hex(word))
    except ValueError:
        return False


def _read(stream: BinaryIO, shown: _Json | _Text, end: End | None) -> bool:
    block, text = opening(stream)
    if not is_json(text):
        return _stream(chunks(stream, block, text), shown, end)
    right = True
    for name, raw in captures(stream, block):
        right &= shown.frame(raw, name)
    return right


def _stream(parts: Iterable[bytes], shown: _Json | _Text, end: End | None) -> bool:
    framer = shown.protocol.framer(end or End.NONE)
    counts: dict[str, int] = {}
    read = 0
    with progress() as say:
        for part in parts:
            for event in framer.feed(part):
                kind = shown.event(event)
                counts[kind] = counts.get(kind, 0) + 1
            read += len(part)
            say(f"{read} bytes, {counts.get('message', 0)} messages")
    if framer.pending:
        shown.pending(bytes(framer.pending))
    shown.summary(read, counts, len(framer.pending))
    return not (framer.pending or counts.get("garbage") or counts.get("bad_length"))


class _Json:
    """Answers in the shape of the testee's, one per line."""

    def __init__(self, protocol: Protocol, context: dict[str, str] | None) -> None:
        self.protocol = protocol
        self.context = context
        self._count = 0

    def frame(self, raw: bytes, name: str = "") -> bool:
        """Show one frame that must be right; return whether it is."""
        self._count += 1
        try:
            frame = self.protocol.decode(raw, self.context)
        except CodecError as error:
            self._print({"id": self._count} | refusal(error))
            return False
        self._print({"id": self._count, "ok": True} | frame_answer(frame))
        return True

    def event(self, event: Event) -> str:
        """Show one event of a stream; return its kind."""
        answer = event_answer(self.protocol, event, self.context)
        self._print(answer)
        return str(answer["event"])

    def pending(self, raw: bytes) -> None:
        """Show what is left at the end of a stream."""
        self._print({"pending": raw.hex()})

    def summary(self, read: int, counts: dict[str, int], pending: int) -> None:
        """Say nothing: every line on standard output is JSON."""

    @staticmethod
    def _print(answer: Json) -> None:
        sys.stdout.write(json.dumps(answer, separators=(",", ":")) + "\n")


class _Text:
    """A table for a frame, a line for each event of a stream."""

    def __init__(self, protocol: Protocol, context: dict[str, str] | None) -> None:
        self.protocol = protocol
        self.context = context
        self._console: Console = console()

    def frame(self, raw: bytes, name: str = "") -> bool:
        """Show one frame that must be right, or why it is not; return whether it is."""
        if name:
            self._say(f"{name}: {spaced(raw)}")
        try:
            answer = frame_answer(self.protocol.decode(raw, self.context))
        except (DecodeError, UnknownMessageError) as error:
            for line in explain(self.protocol, raw, error):
                self._say(line)
            return False
        self._say(frame_title(self.protocol, answer))
        if answer["fields"] or answer.get("extra") or answer.get("data"):
            self._console.print(frame_table(self.protocol, answer))
        if answer["form"] == "data:undecided":
            known = Codec(self.protocol).contexts()
            options = [f"--{key} {' or '.join(values)}" for key, values in known.items()]
            self._say(f"the bytes do not say which layout this is; {', '.join(options)} does")
        if name:
            self._say("")
        return True

    def event(self, event: Event) -> str:
        """Show one event of a stream; return its kind."""
        answer = event_answer(self.protocol, event, self.context)
        if "hex" in answer:
            self._say(f"{answer['event']}: {spaced(event.raw)}")
        else:
            self._say(frame_line(answer))
        return str(answer["event"])

    def pending(self, raw: bytes) -> None:
        """Show what is left at the end of a stream."""
        self._say(f"incomplete at the end: {spaced(raw)}")

    def summary(self, read: int, counts: dict[str, int], pending: int) -> None:
        """Say on standard error what came."""
        found = [f"{number} {kind}" for kind, number in sorted(counts.items())]
        found += [f"{pending} bytes incomplete"] * bool(pending)
        typer.echo(f"{read} bytes: {', '.join(found) or 'nothing'}", err=True)

    @staticmethod
    def _say(text: str) -> None:
        sys.stdout.write(f"{text}\n")
