"""Virtual MS-2000 and MFC-2000: servo axes on a line without addresses, frames or acknowledgements.

Built on :class:`stagewire.framing.CommandFramer`. Strategies choose between two readings of the document
(:mod:`~stagewire_virtual.asi_ms2000.instrument`), so that hosts can be tested with both. Sections in
docstrings are those of the document, numbered from 1 as in the registry.
"""
