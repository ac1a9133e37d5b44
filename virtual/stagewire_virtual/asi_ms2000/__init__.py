"""The MS-2000 and the MFC-2000: servo axes behind a line without addresses, frames or acknowledgement.

Built upon :class:`stagewire.framing.CommandFramer`. Where the document leaves two readings open, both can be
had (:mod:`~stagewire_virtual.asi_ms2000.instrument`), so that hosts can be tried with either. Sections in
docstrings are those of the document, counted from one as in the registry.
"""
