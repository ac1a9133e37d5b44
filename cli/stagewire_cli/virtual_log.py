"""``stagewire virtual --log``: the traffic of each line as a capture, with every frame decoded in a comment.

The comments have the format of ``stagewire decode``.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import cached_property, partial
from pathlib import Path
from typing import TextIO, cast

from stagewire.capture import CaptureWriter, Heading
from stagewire.framing import Event
from stagewire.protocols import Direction
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.formats.task import Task
from stagewire_cli.rendering import frame_line
from stagewire_cli.selection import Selection
from stagewire_conformance.answers import frame_answer
from stagewire_conformance.framings import EVENT_NAMES
from stagewire_virtual.serving.link import Link

Piece = tuple[bytes, str]
"""Bytes, and a description of the event that they completed, or ``incomplete``."""


class Conversation:
    """Decodes both directions of one line; accepts any bytes.

    :param task: the protocol, and the facts needed to decode it.
    """

    def __init__(self, task: Task) -> None:
        self._task = task
        self._readers = task.readers()

    def pieces(self, direction: Direction, data: bytes) -> list[Piece]:
        """Return bytes of one direction, cut at the ends of their frames."""
        reader = self._readers[direction]
        old = len(
            reader.pending
        )  # bytes that the next event includes, but that were returned before
        found: list[Piece] = []
        said: list[str] = []
        at = 0
        for event in reader.feed(data):
            said.append(self._words(event))
            new = max(0, len(event.raw) - old)
            old = max(0, old - len(event.raw))
            if new:
                found.append((data[at : at + new], "; ".join(said)))
                said = []
                at += new
        if at < len(data):
            said.append(_raw("incomplete", data[at:]))
            found.append((data[at:], "; ".join(said)))
        return found

    def _words(self, event: Event) -> str:
        decoded = self._task.found(event)
        if decoded is None:
            return _raw(EVENT_NAMES[type(event)], event.raw)
        return frame_line(self._task.protocol, frame_answer(decoded))


def _raw(kind: str, raw: bytes) -> str:
    """Describe bytes that are not a message; show them if they are text, as from a terminal."""
    text = raw.decode("latin-1")
    is_text = text.isascii() and text.rstrip("\r\n").isprintable() and text.strip()
    return f"{kind} {text!r}" if is_text else kind


STANDARD_OUTPUT = "-"


@contextmanager
def logs(target: str, links: Sequence[Link], source: Path | None) -> Iterator[dict[Link, Log]]:
    """Yield a log for each link; files are closed when the block ends.

    A capture is of one line, so several links get separate files ``session-1.txt`` and so on. On standard
    output their lines begin with the label. Files are opened by :func:`begin` or by the first record, so if
    serving fails, the log of the last session is kept.

    :param source: the bench or the capture that is read.

    Raises :class:`CalledWronglyError` if a log would replace the source.
    """
    path, several = Path(target), len(links) > 1
    with ExitStack() as stack:
        made: dict[Link, Log] = {}
        for number, link in enumerate(links, 1):
            if target == STANDARD_OUTPUT:
                out = _labelled(link.label) if several else sys.stdout
                made[link] = Log(link, "standard output", partial(_as_it_is, out))
            else:
                own = path.with_stem(f"{path.stem}-{number}") if several else path
                if source is not None and own.exists() and own.samefile(source):
                    raise CalledWronglyError(
                        f"--log {own} would replace the file that is being read; give another name"
                    )
                made[link] = Log(link, str(own), partial(_opened, own, stack))
        yield made


def begin(logs: Iterable[Log]) -> None:
    """Open all logs, and replace the contents of their files.

    Raises :class:`CalledWronglyError` for a file that cannot be written.
    """
    for log in logs:
        try:
            log.begin()
        except BrokenPipeError:  # the reader of standard output has closed the pipe
            raise
        except OSError as error:
            raise CalledWronglyError(
                f"--log {log.name}: cannot be written: {error.strerror or error}; name a file in a folder "
                "that exists and that you can write to"
            ) from None


class Log:
    """Records one line.

    :param link: the link to record.
    :param name: the name of the file for people.
    :param opened: opens the file, which is flushed after every chunk so that it can be followed.
    """

    def __init__(self, link: Link, name: str, opened: Callable[[], TextIO]) -> None:
        unit = link.instrument.unit
        self.name = name
        self._heading = Heading(unit.protocol.name, unit.name)
        self._opened = opened
        self._conversation = Conversation(Selection(recorded=self._heading).task())

    @cached_property
    def _out(self) -> TextIO:
        return self._opened()

    @cached_property
    def _writer(self) -> CaptureWriter:
        return CaptureWriter(self._out, self._heading)

    def begin(self) -> None:
        """Open the log if it is not open; raise :class:`OSError` if it cannot be written."""
        _ = self._writer
        self._out.flush()

    def passed(self, when: int, direction: Direction, data: bytes) -> None:
        """Record bytes of one direction."""
        for piece, words in self._conversation.pieces(direction, data):
            self._writer.write(when, direction, piece, words)
        self._out.flush()

    def note(self, when: int, text: str) -> None:
        """Record a note for people."""
        self._writer.note(when, text)
        self._out.flush()


class _Labelled(io.TextIOBase):
    """Standard output, with the label of its unit before each line."""

    def __init__(self, label: str) -> None:
        self._label = label

    def write(self, line: str) -> int:
        """Write a whole line."""
        return sys.stdout.write(f"{self._label}: {line}")

    def flush(self) -> None:
        """Flush standard output."""
        sys.stdout.flush()


def _as_it_is(out: TextIO) -> TextIO:
    return out


def _opened(path: Path, stack: ExitStack) -> TextIO:
    file = path.open("w", encoding="utf-8")
    stack.callback(_close, file)
    return file


def _close(file: TextIO) -> None:
    """Close a file; write errors were reported when it was flushed."""
    with suppress(OSError):
        file.close()


def _labelled(label: str) -> TextIO:
    return cast(TextIO, _Labelled(label))
