"""Cutting a stream of bytes into frames, without any input or output.

Bytes go in by :meth:`Framer.feed`, events come out. A frame is a header of six bytes: message id,
two parameters or the length of a packet, destination, source. The top bit of the destination says
that a packet follows. There is no checksum and no start mark, so that one damaged byte can put the
receiver out of step. The rule below was chosen by damaging streams at every position and counting
what was lost and what was invented afterwards (``benchmarks/framing_experiment.py``).

**Terms.** An id is *ours* when the end that we sit on (:class:`End`) receives messages of its
direction; who only listens on the line (``End.NONE``) receives both. Addresses are *right* when
one is the host's, the other a controller's, and they point in a direction that the id has and that
we receive. They are *tolerated* when right, when unswapped (the controller sent back the addresses
of the request), or 0 and 0.

**The rule.** The framer starts *in step*, that is, where a frame is due.

1. A header that declares a packet of over 255 bytes is garbage.
2. In step, with an id of ours, in a form that it has, and with tolerated addresses:

   * a header form, or a data form of exactly a known length, is a message;
   * a packet shorter than every layout is ``BadLength``, consumed by its declared length;
   * a packet longer than its layout is a message with extra bytes, as newer controllers send. But
     when the surplus could hold a header (6 bytes) and a header that would be accepted out of step
     stands anywhere inside the declared frame, then the length is what was damaged: garbage up to
     that header;
   * a header form whose parameters spell one of the packet lengths of its id is garbage. It is a
     data frame that lost its top bit, and taken for a header it would start a stored move;
   * a header form of an id with ``only_zero_parameters`` is garbage when they are not zero.

3. In step, an unknown id is ``Unknown`` and skipped by its length, but only with right addresses.
   An id known without a layout is framed in the same way and reported as ``Undocumented``. They
   are not looked into: a payload that is read as headers invents messages.
4. Anything else in step: drop one byte, and be *out of step*.
5. Out of step, bytes are dropped until a header stands there that is ours, in a form that it has,
   of exactly a known length, with tolerated addresses for a data form and right ones for a header
   form (which has less to be recognised by). The framer is in step again.
6. When the rest of a frame does not come and the session gives up (:meth:`Framer.abandon`), the
   length may be what was damaged, and whole frames may have come behind it. So the bytes that
   waited are looked through as by 4 and 5; an unknown frame is dropped as a whole, by the reason
   of 3. In the experiment with a silence after each run (``--silences``) at most 3 frames of 20
   are missing at the host or the device; dropping all that waited cost up to 19, and invented no
   less.

Tried and not taken: accepting header forms with addresses 0 and 0 out of step from a controller
that always sends them. It would lose a third fewer frames of such a controller, but payloads near
zero imitate such headers, and fifteen times as many messages were invented. A completion that
nobody sent is worse than an answer that has to be asked for again.

**Any chunking gives the same.** Every decision looks at a header or at a whole declared frame,
never at how much happens to be there, and never at the clock; what is not all there is waited for.
The one trace of a chunk is that garbage is given out at the end of each feed: compare streams
after :func:`join_garbage`.

**Time and memory are bounded.** Less than one maximal frame is pending between feeds; it is not
looked at again before as many bytes are there as the decision needs; and no byte is part of more
than a few decisions, whatever comes.
"""
