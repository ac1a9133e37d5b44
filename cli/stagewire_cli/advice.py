"""Advice of the library in the words of the command: options in place of Python keywords."""

from __future__ import annotations

import re
from typing import Final

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
