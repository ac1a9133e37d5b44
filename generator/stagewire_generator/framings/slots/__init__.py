"""Commands in slots, setup commands of two bytes, and replies that consist of data only."""
