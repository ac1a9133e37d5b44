"""``stagewire virtual --log``: what is said on each line, as a capture with every frame in words."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TextIO, cast

from stagewire.capture import CaptureWriter, Heading
from stagewire.direction import Direction
from stagewire_cli.conversation import Conversation
from stagewire_cli.selection import Selection
from stagewire_virtual.serving.link import Link

__all__ = ["STANDARD_OUTPUT", "Log", "logs"]

STANDARD_OUTPUT = "-"


@contextmanager
def logs(target: str, links: Sequence[Link]) -> Iterator[dict[Link, Log]]:
    """Give a log for each link; files are closed when the block ends.

    Several get files of their own, ``session-1.txt`` and so on, since a capture is of one line. On standard
    output their lines begin with the label.

    Raises :class:`OSError` for a file that cannot be written.
    """
    path, several = Path(target), len(links) > 1
    with ExitStack() as stack:
        made: dict[Link, Log] = {}
        for number, link in enumerate(links, 1):
            if target == STANDARD_OUTPUT:
                out = _labelled(link.label) if several else sys.stdout
            else:
                own = path.with_stem(f"{path.stem}-{number}") if several else path
                out = stack.enter_context(own.open("w", encoding="utf-8"))
            made[link] = Log(link, out)
        yield made


class Log:
    """Records one line.

    :param link: what is recorded.
    :param out: where to; flushed after every chunk, since somebody may be looking on.
    """

    def __init__(self, link: Link, out: TextIO) -> None:
        unit = link.instrument.unit
        heading = Heading(unit.protocol.name, unit.name)
        self._out = out
        self._writer = CaptureWriter(out, heading)
        self._conversation = Conversation(Selection(recorded=heading).task())

    def passed(self, when: int, direction: Direction, data: bytes) -> None:
        """Record bytes that went one way."""
        for piece, words in self._conversation.pieces(direction, data):
            self._writer.write(when, direction, piece, words)
        self._out.flush()

    def note(self, when: int, text: str) -> None:
        """Record something for people."""
        self._writer.note(when, text)
        self._out.flush()


class _Labelled(io.TextIOBase):
    """Standard output, each line behind the label of the unit that it concerns."""

    def __init__(self, label: str) -> None:
        self._label = label

    def write(self, line: str) -> int:
        """Write a whole line, as captures are written."""
        return sys.stdout.write(f"{self._label}: {line}")

    def flush(self) -> None:
        """Hand on what has been written."""
        sys.stdout.flush()


def _labelled(label: str) -> TextIO:
    return cast(TextIO, _Labelled(label))
