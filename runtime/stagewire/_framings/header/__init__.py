"""Frames with a header of six bytes: messages, frames, the framer and the protocol class; sans-I/O.

Bytes go in by :meth:`Framer.feed`, events come out. The header holds the message id, two parameters or
the length of a packet, the destination and the source. The top bit of the destination announces a
packet. There is no checksum and no start mark, so one damaged byte can put the receiver out of step. The
rule below was chosen by experiment: streams were damaged at every position, and lost and invented
messages were counted (``benchmarks/framing_experiment.py``).

**Terms.** An id is *ours* if our end of the line (:class:`End`) receives messages of its direction. A
listener (``End.NONE``) receives both directions. Addresses are *right* if one is the host's, the other a
controller's, and they match a direction that the id has and that we receive. They are *tolerated* if they
are right, if they are unswapped (the controller repeated the addresses of the request), or if both are 0.

**The rule.** The framer starts *in step*: it expects a frame at the current position.

1. A header that declares a packet of over 255 bytes is garbage. The packets of a message with an array may
   be longer: the registry gives the longest, and the header of another message cannot declare it.
2. In step, with an id of ours, in a form that the id has, and with tolerated addresses:

   * a header form, or a data form of exactly a known length, is a message;
   * a packet shorter than every layout is ``BadLength``; its declared length is consumed;
   * a packet longer than its layout is a message with extra bytes, as newer controllers send. There is one
     exception. If the surplus has room for a header (6 bytes) and the declared frame contains a header
     that would be accepted out of step, the length itself was damaged: the bytes up to that header are
     garbage;
   * a header form whose parameters equal one of the packet lengths of its id is garbage. It is a data
     frame that lost its top bit; accepted as a header, it would start a stored move. Programs are known to
     send a few messages without the bit, which the registry names (``without_flag``). A header that begins
     with the id and the length of one of them has a packet in all rules, as if the bit were set;
   * a header form of an id with ``only_zero_parameters`` is garbage unless its parameters are zero.

3. In step, an unknown id is ``Unknown`` and skipped by its length, but only with right addresses. An id
   known without a layout is framed the same way and reported as ``Undocumented``. The framer does not search
   the payload of these frames, because reading a payload as headers invents messages.
   An id may belong to several messages, each with a *sub-message*: the first parameter of a header, or the
   first word of a packet. Rules 2 and 5 then apply to the forms of the sub-message, once the whole frame has
   arrived. The search in rule 2 and the refused parameters concern the lengths of all its messages. A frame
   with an unknown sub-message is ``UnknownSubMessage``, under the conditions of ``Unknown``.
   A packet that ends with an array has the length that its fields state. If the declared length is another,
   the rule 2 for overlong packets applies: with a header in it, it is garbage, otherwise ``BadLength``. It is
   never a message with extra bytes. Out of step, its fields must agree with its length.
4. Anything else in step: drop one byte and be *out of step*.
5. Out of step, drop bytes up to a header that is ours, in a form that the id has, of exactly a known length,
   with tolerated addresses for a data form and right ones for a header form (which has fewer recognisable
   bytes). The framer is then in step again.
6. If the rest of a frame does not arrive, the session gives up (:meth:`Framer.abandon`). The length may be
   the damaged part, and whole frames may follow it, so the pending bytes are searched by rules 4 and 5. A
   pending unknown frame is dropped whole, for the reason in rule 3. In the experiment with a silence after
   each run (``--silences``), at most 3 frames of 20 are lost at the host or the device. Dropping all pending
   bytes lost up to 19 and invented as many messages.

Rejected alternative: accepting header forms with both addresses 0 out of step, for a controller that always
sends them. It would lose a third fewer frames of such a controller. But payloads near zero imitate such
headers, and fifteen times as many messages were invented. An invented completion is worse than an answer
that must be requested again.

**Chunking does not matter.** Every decision uses a whole header or a whole declared frame, never the amount
of data available or the clock. The framer waits for missing bytes. Chunks leave one trace: garbage is
returned at the end of each feed. Compare streams after :func:`join_garbage`.

**Time and memory are bounded.** Less than one maximal frame is pending between feeds. Pending bytes are
looked at again only when enough bytes for the decision have arrived, and no byte takes part in more than a
few decisions, for any input.
"""
