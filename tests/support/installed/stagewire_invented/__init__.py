"""The invented protocol of packets as an installed package; what stands in it is written by hand."""

from invented_packets import PROTOCOL

__all__ = ["PROTOCOL"]
