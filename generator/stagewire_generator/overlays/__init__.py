"""Overlays: later issues of a document, which add to a protocol and override parts of it by name."""
