"""Motor channels: moves, and the stage with its limits, homing, counters and status bits."""
