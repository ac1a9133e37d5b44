"""Piezo controllers: volts for an actuator, in open loop or closed by a strain gauge (pages 93 to 126)."""

from stagewire_virtual.thorlabs_apt.piezo.piezo import Piezo

__all__ = ["Piezo"]
