"""Framings: how bytes become messages. Each has a folder, named like ``framing.kind`` in ``protocol.yaml``.

A folder holds the messages of its framing, the frames or packets that carry them, the framer with its
events, and the protocol class. The docstring of the folder states the rule by which the framer cuts a
stream. A generated package creates one protocol object, and all other code uses that object. The public
names are in :mod:`stagewire.protocols`, :mod:`stagewire.framing` and :mod:`stagewire.support`.
"""
