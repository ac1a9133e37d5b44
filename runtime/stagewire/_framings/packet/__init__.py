"""Packets that begin with bytes that are always the same, and say how long they are; no input or output.

Most binary protocols of laboratory devices look alike: start bytes, a length, an id, perhaps an address,
a payload, a check, perhaps end bytes. What they look like in one protocol is data (:class:`Shape`), so that
a protocol of packets needs no code of its own. A payload is sent as it is: no byte of it is escaped, and
start bytes may stand in it.

**The rule** (:class:`PacketFramer`). A packet stands where the start bytes are followed by a length that a
packet can have and, as far behind as it says, by the right check and the right end bytes.

1. Where a packet stands, it is one event: a message, with extra bytes where its payload is longer than the
   longest layout that it fills; ``UnknownPacket`` when no message has its id; ``BadPacketLength`` when its
   payload fits no layout. The next byte is looked at next.
2. Where none stands, one byte is garbage, and the next start bytes are looked for. So a damaged packet is
   looked into: nothing that it held, its length least of all, is believed, and the packets behind it
   are found even where its damaged length reaches over them.
3. What is not all there is waited for. A damaged length may have to be waited for long, until as many bytes
   have come as it says; when they do not come, and the session gives up (:meth:`PacketFramer.abandon`),
   whole packets behind the start bytes are given out.

What is lost is the damaged packet. A second one is lost only where bytes that are no packet happen to
have a right check: once in 256 tries for a byte, once in 65536 for two. Without a check every start byte in a
payload is believed when the packet before it was damaged; such a protocol may lose more, and invent messages.

**Any chunking gives the same.** Every decision looks at bytes that are all there, never at how much happens
to come at once, and never at the clock. The one trace of a chunk is that garbage is given out at the end
of each feed: compare streams after :func:`~stagewire.framing.join_garbage`.

**Time and memory are bounded.** Less than one longest packet is pending between feeds, and is not looked at
again before as many bytes are there as the decision needs. A byte is part of one check for each start
that stands before it within the length of a packet: one in a stream without damage, and in a stream that is
made to be slow no more than a packet has bytes.
"""
