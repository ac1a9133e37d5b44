"""Output formats of ``stagewire decode``, with one interface; ``format`` has the list of formats.

A :class:`~stagewire_cli.formats.writer.Writer` accepts frames and events. Writers of tables
(:mod:`~stagewire_cli.formats.rows`) pass columns to a :class:`~stagewire_cli.formats.sinks.Sink`, which is
independent of frames.
"""
