"""One folder for each framing, named as ``framing.kind`` in ``protocol.yaml``.

:mod:`stagewire_generator.framing` has a row for each, and says what the modules of a folder are for.
"""
