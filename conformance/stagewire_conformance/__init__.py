"""What an implementation must do: the worked examples of the documents, and the testee protocol.

:func:`run` runs every worked example and capture of a protocol, :func:`coverage` says which messages
have any, :func:`serve` answers the requests of the testee protocol.
"""

from stagewire_conformance.examples import Coverage, coverage, run
from stagewire_conformance.testee import serve
from stagewire_conformance.verdict import Verdict

__all__ = ["Coverage", "Verdict", "coverage", "run", "serve"]
