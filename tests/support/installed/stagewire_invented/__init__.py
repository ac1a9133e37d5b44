"""The invented packet protocol as an installed package. Its files are written by hand."""

from invented_packets import PROTOCOL

__all__ = ["PROTOCOL"]
