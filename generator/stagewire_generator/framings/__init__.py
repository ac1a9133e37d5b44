"""One directory for each framing, named like ``framing.kind`` in ``protocol.yaml``.

:mod:`stagewire_generator.framing` has a row for each framing and describes the modules of a directory.
"""
