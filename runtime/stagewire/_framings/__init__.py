"""How bytes become messages: one folder for each framing, named as ``framing.kind`` in ``protocol.yaml``.

A folder holds the messages of its framing, what carries them, the framer with its events, and the class of
the protocol. Its docstring states the rule by which the framer cuts a stream. A generated package makes an
object of the class of its framing, and everything else asks that object. The public names of a folder are
published in :mod:`stagewire.protocols`, :mod:`stagewire.framing` and :mod:`stagewire.support`.
"""
