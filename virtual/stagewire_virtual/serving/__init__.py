"""Links from a host to a virtual controller: in memory, by TCP and on a pseudo-terminal."""
