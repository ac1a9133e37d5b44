"""The one command ``stagewire``; every sub-command is a module of its own."""
