"""The parts of a motor channel: scales, defaults, ways to move, limits, homing, counters and status bits."""
