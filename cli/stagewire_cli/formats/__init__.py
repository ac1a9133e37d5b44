"""Output formats of ``stagewire decode``, with one interface; ``format`` has the table of formats.

A :class:`~stagewire_cli.formats.writer.Writer` takes frames and events. Those for tables of rows
(:mod:`~stagewire_cli.formats.rows`) hand columns to a :class:`~stagewire_cli.formats.sinks.Sink`, which
knows nothing of frames.
"""
