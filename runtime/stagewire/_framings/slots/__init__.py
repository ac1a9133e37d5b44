"""Commands that a host sends to axes, and replies without a frame; no input or output.

A command is an axis identifier, the byte of the command, the number of its data bytes, the data and a
terminator. Its number may be left out where there is no data to send. A setup command is a prefix and one
byte more. A reply is its data and nothing else. Prefix, terminator and commands are those of the protocol
(:class:`CommandProtocol`); there is no checksum.

**Commands** (:class:`CommandFramer`), read slot by slot as a controller reads them:

1. Where a command is due, the prefix and the byte of a setup command are a setup command, which no
   terminator ends. The prefix and anything else are garbage, and so is a terminator alone. Any other
   byte is an axis: identifiers can be changed on a controller, so that none is refused.
2. The second byte is the command's. A terminator there means that the command was aborted: garbage.
   A byte that is no command's is ``UnknownCommand`` up to the next terminator.
3. The third byte is the size slot. A terminator there means that the slot was left out: a whole command
   when it has no data, else ``BadCommandLength``. Another number than the command's own (that of its data,
   or of its reply's; 0 without either, or where the document leaves the slot out) is
   ``BadCommandLength`` up to the next terminator behind the slot.
4. As many bytes of data follow as the command has. A terminator among them is data.
5. Everything from there to the next terminator is ignored by controllers and kept as ``extra``. A lost
   byte so makes the next command a part of the one before. Nothing in the bytes tells: who writes half
   a command does not mend it by sending terminators, which would be data.
6. Garbage ends with the next terminator. No command is longer than 259 bytes, what a number of one byte
   can count and four more; when its terminator has not come by then, all is garbage up to the next one.

**Replies** (:class:`ReplyDecoder`) are read by the request that is outstanding; see
:mod:`stagewire._framings.slots.replies`.

The framer knows the low-level format alone: after a setup command that switches to another format, what comes
is not commands. Who serves a controller stops feeding it then, and calls ``reset`` when it comes back. Who
only listens, such as a log, cuts both formats by :mod:`stagewire._framings.slots.streams`.

**Any chunking gives the same.** What is not all there is waited for, by no clock. The one trace of a
chunk is that garbage is given out at the end of each feed: compare streams after
:func:`~stagewire.framing.join_garbage`.

**Time and memory are bounded.** Less than one longest command is pending between feeds, and garbage is
never held.
"""
