"""Packets that begin with fixed start bytes and contain their length; sans-I/O.

Most binary protocols of laboratory devices look alike: start bytes, a length, an id, perhaps an address,
a payload, a check, perhaps end bytes. The details of one protocol are data (:class:`Shape`), so a protocol
of packets needs no code of its own. Payload bytes are not escaped, so a payload may contain start bytes.

**The rule** (:class:`PacketFramer`). A packet is found where the start bytes are followed by a valid length
and, at the distance that the length gives, by the right check and the right end bytes.

1. Each packet found is one event: a message, with extra bytes if its payload is longer than the longest
   layout that it fills; ``UnknownPacket`` if no message has its id; ``BadPacketLength`` if its payload fits
   no layout. The search continues after the packet.
2. If no packet is found at the start bytes, one byte is garbage and the search continues with the next start
   bytes. A damaged packet is therefore searched too: none of its contents are trusted, least of all its
   length, and later packets are found even if the damaged length extends over them.
3. The framer waits for missing bytes. A damaged length may make it wait for a long time. If the bytes do not
   arrive and the session gives up (:meth:`PacketFramer.abandon`), whole packets after the start bytes are
   returned.

Only the damaged packet is lost. A second one is lost only if bytes that are not a packet happen to have a
right check: once in 256 tries with a check of one byte, once in 65536 with two. Without a check, every start
byte in the payload of a damaged packet is trusted; such a protocol may lose more packets and invent messages.

**Chunking does not matter.** Every decision uses bytes that have arrived completely, never the size of a
chunk or the clock. Chunks leave one trace: garbage is returned at the end of each feed. Compare streams after
:func:`~stagewire.framing.join_garbage`.

**Time and memory are bounded.** Less than one longest packet is pending between feeds. Pending bytes are
looked at again only when enough bytes for the decision have arrived. A byte is part of one check for each
start found before it within the length of a packet: one in an undamaged stream, and at most as many as a
packet has bytes in a stream crafted to be slow.
"""
