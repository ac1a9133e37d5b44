"""Conformance suites: worked examples of the documents, codecs in any language, and controllers.

:func:`run` runs the worked examples and captures of a protocol, :func:`coverage` returns which messages have
any, and :func:`serve` answers the requests of the testee protocol.
"""

from stagewire_conformance.examples import Coverage, coverage, run
from stagewire_conformance.testee import serve
from stagewire_conformance.verdict import Verdict

__all__ = ["Coverage", "Verdict", "coverage", "run", "serve"]
