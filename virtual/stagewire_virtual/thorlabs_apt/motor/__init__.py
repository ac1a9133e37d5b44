"""Motor channels: moves, the stage that they move, and its limits, homing, counters and status bits."""
