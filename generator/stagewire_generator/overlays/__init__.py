"""Overlays: later issues of a document that add to a protocol or replace entries of it by name."""
