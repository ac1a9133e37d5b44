"""Hex in any spelling, block by block: blanks, commas, colons, ``0x``, comments after ``#``."""

from __future__ import annotations

import contextlib
import re

__all__ = ["HexText", "parse_hex"]

_SEPARATOR = re.compile(r"[\s,;:|_\-\[\](){}'\"]+|(?=\\x)")
_DIGITS = re.compile(r"[0-9A-Fa-f]+\Z")
_PREFIX = re.compile(r"0[xX]|\\x")
_LONG = 4096


def parse_hex(text: str) -> bytes:
    """Return the bytes of a whole text.

    Raises :class:`ValueError` with a plain sentence.
    """
    reader = HexText()
    return reader.feed(text) + reader.finish()


class HexText:
    """Turns blocks of text into bytes; what a block cuts in two waits for the next."""

    def __init__(self) -> None:
        self._tail = ""
        self._comment = False
        self._line = 1
        self._inside = False  # the tail goes on with a word whose beginning was given out

    def feed(self, block: str) -> bytes:
        """Take the next block; raise :class:`ValueError` for what is no hex."""
        made = bytearray()
        for number, line in enumerate(block.split("\n")):
            if number:
                made += self._end_of_line()
            made += self._part(line)
        return bytes(made)

    def finish(self) -> bytes:
        """Take the end of the text."""
        return self._end_of_line()

    def _end_of_line(self) -> bytes:
        made = self._word(self._tail)
        self._tail, self._comment, self._inside = "", False, False
        self._line += 1
        return made

    def _part(self, text: str) -> bytes:
        if self._comment:
            return b""
        text, hash_, _ = text.partition("#")
        self._comment = bool(hash_)
        text = self._tail + text
        made = bytearray()
        cut = text.rfind(" ") + 1
        if cut and not self._inside:
            # Pairs and blanks alone, as nearly all hex text is, are read at once; fromhex takes
            # nothing that the words below would not.
            with contextlib.suppress(ValueError):
                made += bytes.fromhex(text[:cut])
                text = text[cut:]
        *words, self._tail = _SEPARATOR.split(text)
        for word in words:
            made += self._word(word)
            self._inside = False
        if len(self._tail) > _LONG:
            whole = len(self._tail) - 2 - len(self._tail) % 2
            made += self._word(self._tail[:whole])
            self._tail, self._inside = self._tail[whole:], True
        return bytes(made)

    def _word(self, word: str) -> bytes:
        if not word:
            return b""
        prefix = None if self._inside else _PREFIX.match(word)
        digits = word[prefix.end() :] if prefix else word
        if prefix and len(digits) == 1:
            digits = f"0{digits}"
        if len(digits) % 2 or not _DIGITS.match(digits):
            shown = word if len(word) <= 40 else f"{word[:40]}…"
            raise ValueError(f"line {self._line}: {shown!r} is not bytes as pairs of hex digits")
        return bytes.fromhex(digits)
