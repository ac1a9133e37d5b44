"""Bytes that select a sub-message, for tests that draw all other bytes."""

from __future__ import annotations


def selecting(data: bytes, sub_message: int | None, form: str) -> bytes:
    """Return the parameters of a header, or a packet, with the bytes that select a sub-message.

    :param sub_message: None for a message that does not share its id; the data are then unchanged.
    """
    if sub_message is None:
        return data
    first = sub_message.to_bytes(1 if form == "header" else 2, "little")
    return first + data[len(first) :]
