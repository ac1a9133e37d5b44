"""``stagewire testee``: the Python codec as a testee of the conformance suite."""

from __future__ import annotations

import sys

EXAMPLE = """\b
Example:
  echo '{"id":1,"op":"hello"}' | stagewire testee
"""


def testee() -> None:
    """Run Stagewire's codec as a testee of the conformance suite.

    Reads requests from standard input and writes the answers to standard output, one JSON object per line.
    """
    from stagewire_conformance.testee import lines_of, serve

    serve(lines_of(sys.stdin.buffer), _write)


def _write(line: str) -> None:
    sys.stdout.buffer.write(line.encode("ascii"))  # "\n" on every system
    sys.stdout.buffer.flush()


testee.__test__ = False  # type: ignore[attr-defined]
