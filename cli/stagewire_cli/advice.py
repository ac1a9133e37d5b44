"""Advice of the library in the words of the command: options in place of Python keywords."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from stagewire_cli.output import printable

_WORDS: Final = (
    (r"\(unit='TDC001', or --unit TDC001 on the command line", "(--unit TDC001"),
    (r"a rack is asked only by its name or with bay=", "a rack is asked only with --unit or --bay"),
    (r"\(bay= or --bay\)", "with --bay"),
    (r" and its bay \(bay=\)", " and its bay (--bay)"),
    (r"pass one of them as address= to choose it", "choose one with --address"),
    (r", or pass identify=False to [^.;:]*", ""),
    (r"open it without model=", "name another unit with --unit"),
    (r"pass model= to open to choose one", "choose one with --unit"),
    (r"pass model= or stage=Stage\.of_user\(\.\.\.\) to open",
     "choose one with --unit, or give your own stage with --stages FILE --stage NAME"),
    (r"pass stage=( \([^)]*\))? or stage=Stage\.of_user\(\.\.\.\) to open",
     r"give --stage NAME\1, or your own stage with --stages FILE --stage NAME"),
    (r"(?:pass stage=|use )Stage\.of_user\(\.\.\.\)(?: to open| for others| to give its scales yourself)",
     "give your own stage with --stages FILE --stage NAME"),
    (r"pass stage= to open", "give --stage NAME"),
    (r"call enable\(\), which disables the other channels", "give --enable, which disables the others"),
    (r"(motions will be refused: .*); call enable\(\)", r"\1; give --enable to move, home or jog"),
    (r"call enable\(\)", "give --enable"),
    (r"open it with baudrate=(\d+), or set", r"use the library with baudrate=\1, or set"),
    (r"serial_number=(\d+)", r"usb://\1"),
)  # fmt: skip
"""A pattern in a message of the library, and what the command says instead."""

_COMPILED: Final = tuple((re.compile(pattern), words) for pattern, words in _WORDS)


def for_command(text: str) -> str:
    """Return a message of the library with the options of the command."""
    for pattern, words in _COMPILED:
        text = pattern.sub(words, text)
    return text


@contextmanager
def warnings_printed(*, refusals: bool) -> Iterator[None]:
    """Print what the library logs as a warning in a block, with the options of the command.

    :param refusals: whether to print which motions will be refused. A command that moves needs no such
        warning, because its own motion raises the error.
    """
    import logging

    class InWords(logging.Formatter):
        def format(self, record: logging.LogRecord) -> str:
            return printable(for_command(f"warning: {super().format(record)}"))

    log = logging.getLogger("stagewire")
    if log.handlers:  # another line is open
        yield
        return
    handler = logging.StreamHandler()
    handler.setLevel(logging.WARNING)
    handler.setFormatter(InWords())
    handler.addFilter(lambda record: refusals or "motions will be refused" not in str(record.msg))
    log.addHandler(handler)
    try:
        yield
    finally:
        log.removeHandler(handler)
