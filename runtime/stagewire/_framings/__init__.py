"""How bytes become messages: one folder for each framing, named as ``framing.kind`` in ``protocol.yaml``."""
