"""How a host reaches a virtual controller: in memory, by TCP, by a pseudo-terminal."""
