"""For people and their customers: one HTML page that needs nothing but itself.

No script, no request to anywhere; for screens from 320 px up, light and dark, and for paper. Whatever comes
from a controller is escaped, and so is what cannot be seen.
"""

from __future__ import annotations

from stagewire_conformance.reports.html.page import as_html

__all__ = ["as_html"]
