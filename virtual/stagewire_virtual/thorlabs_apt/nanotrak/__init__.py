"""NanoTraks: a spot of light, an amplifier with ranges, and a circle that follows the highest signal."""
