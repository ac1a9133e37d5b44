"""Commands from a host to axes, and replies without a frame; sans-I/O.

A command is an axis identifier, the command byte, the number of its data bytes, the data and a terminator.
The number may be omitted if there is no data to send. A setup command is a prefix and one more byte. A reply
consists only of its data. The protocol (:class:`CommandProtocol`) defines prefix, terminator and commands.
There is no checksum.

**Commands** (:class:`CommandFramer`) are read slot by slot, as a controller reads them:

1. At the beginning of a command, the prefix and the byte of a setup command form a setup command, which has
   no terminator. The prefix and any other byte are garbage, and so is a terminator alone. Any other byte is
   an axis: users can change the identifiers of a controller, so all are accepted.
2. The second byte is the command byte. A terminator here means that the command was aborted: garbage. A byte
   that no command has is ``UnknownCommand`` up to the next terminator.
3. The third byte is the size slot. A terminator here means that the slot was omitted: a whole command if it
   has no data, otherwise ``BadCommandLength``. The right number is the size of the data or of the reply, or 0
   if the command has neither or the document omits the slot. Any other number is ``BadCommandLength`` up to
   the next terminator after the slot.
4. As many bytes of data follow as the command has. A terminator among them is data.
5. Controllers ignore everything from there to the next terminator; it is kept as ``extra``. A lost byte
   therefore makes the next command part of the previous one. This cannot be detected from the bytes, and
   sending terminators does not repair half a command, because they would be data.
6. Garbage ends with the next terminator. No command is longer than 259 bytes: 255 bytes, the most that a
   one-byte number can count, and four more. If the terminator has not arrived by then, everything up to the
   next one is garbage.

**Replies** (:class:`ReplyDecoder`) are read according to the outstanding request; see
:mod:`stagewire._framings.slots.replies`.

The framer supports only the low-level format. After a setup command that switches to another format, the
bytes are not commands. A controller stops feeding the framer then, and calls ``reset`` when the low-level
format returns. A listener such as a log cuts both formats with :mod:`stagewire._framings.slots.streams`.

**Chunking does not matter.** The framer waits for missing bytes and uses no clock. Chunks leave one trace:
garbage is returned at the end of each feed. Compare streams after :func:`~stagewire.framing.join_garbage`.

**Time and memory are bounded.** Less than one longest command is pending between feeds, and garbage is never
pending.
"""
