"""Shared by all framings: messages, flags, events and the base of protocols."""
