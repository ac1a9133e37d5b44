"""Piezo controllers: volts for an actuator, in open loop or closed by a strain gauge (pages 93 to 126).

``piezo`` takes the messages, gives the status and has what a user sets; ``refusals`` says what it does not
take. ``drive`` is the output: on its way to what is set (``approach``), or following the waveform table, of
which ``generator`` knows whether it is put out and ``waveform`` which sample at which instant. The rest is
tables: ``parameters`` of a new channel, ``actuator``, ``status_bits``; the strain gauge reader has the last
two in common with it.
"""

from stagewire_virtual.thorlabs_apt.piezo.piezo import Piezo

__all__ = ["Piezo"]
