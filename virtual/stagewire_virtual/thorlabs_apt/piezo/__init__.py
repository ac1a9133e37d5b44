"""Piezo controllers: the voltage of an actuator, in open loop or closed by a strain gauge (pages 93 to 126).

``piezo`` accepts or refuses messages, returns the status and has the inputs for tests. ``drive`` computes the
output, which approaches a set-point or follows a waveform. ``waveform`` has the sample at each instant.
``actuator`` has tables, some of which the strain gauge reader also uses.
"""
