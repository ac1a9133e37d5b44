"""Piezo controllers: volts for an actuator, in open loop or closed by a strain gauge (pages 93 to 126).

``piezo`` takes the messages or refuses them, gives the status and has what a user sets. ``drive`` is the
output: on its way to what is set, or following the waveform table, of which ``waveform`` knows whether it is
put out, and which sample at which instant. ``actuator`` has tables; the strain gauge reader has some.
"""
