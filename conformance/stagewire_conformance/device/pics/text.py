"""A PICS as the text of a TOML file, with comments that say what can be added."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping

from stagewire.protocols import CommandProtocol
from stagewire_conformance.device.declared import Declared
from stagewire_conformance.device.permissions import COUNTS
from stagewire_conformance.device.pics import ChannelPics, Pics

__all__ = ["pics_text"]


def pics_text(pics: Pics, declared: Declared, url: str, told: Mapping[str, int | str]) -> str:
    """Return the text of a PICS.

    :param declared: the same, as a controller.
    :param url: of the line where it was asked for.
    :param told: what the controller said that it is.
    """
    return "\n".join(_lines(pics, declared, url, told)) + "\n"


def _lines(
    pics: Pics, declared: Declared, url: str, told: Mapping[str, int | str]
) -> Iterator[str]:
    is_of_commands = isinstance(declared.protocol, CommandProtocol)
    yield f"# What a {pics.unit} can do, as it answered at {_comment(url)}."
    for name, value in told.items():
        yield f"# {name}: {_comment(str(value).strip())}"
    yield "# Correct it, and give reasons: the suite skips what stands under [unsupported], and nothing else."
    yield ""
    yield "schema_version = 1"
    yield f"protocol = {_text(declared.protocol.name)}"
    yield f"unit = {_text(pics.unit)}"
    if is_of_commands:
        yield '# firmware = "3.3"'
    else:
        yield f'line = {_text(pics.line)}                     # or "rs232", where no signs of life are due'
    yield from _reasons("unsupported", pics.unsupported)
    for bay in pics.bays or ():
        yield from ("", "[[bay]]", f"number = {bay.number}")
        if bay.unit:
            yield f"unit = {_text(bay.unit)}"
        yield from _reasons("bay.unsupported", bay.unsupported)
    for channel in pics.channels:
        yield from _channel(channel, declared, is_of_commands)
    yield from ("", "# [timing]", "# reply_p99_ms = 50            # what you promise, if you do")


def _channel(channel: ChannelPics, declared: Declared, is_of_commands: bool) -> Iterator[str]:
    yield from ("", "[[channel]]")
    if channel.bay is not None:
        yield f"bay = {channel.bay}"
    if channel.axis is not None:
        yield f"axis = {_text(channel.axis)}"
    else:
        yield f"number = {channel.number}"
    if is_of_commands:
        yield '# travel = "-50..50mm"          # where it may go'
        return
    place = next(
        each for each in declared.places if each.channels and each.bay in (channel.bay, 1, None)
    )
    stages = place.unit.stages
    yield (
        f'# stage = "{stages[0]}"' if stages else '# counts_per_mm = "25600"        # of its stage'
    )
    yield f'# travel = "0..12mm"           # where it can go; or in {COUNTS}: "0..400000{COUNTS}"'
    yield "# homes = true                 # whether it can be sent home"
    yield "# limit_switches = true"


def _reasons(header: str, reasons: Mapping[str, str]) -> Iterator[str]:
    if reasons:
        yield from ("", f"[{header}]")
    for name, reason in reasons.items():
        yield f"{name} = {_text(reason)}"


def _text(value: str) -> str:
    """Return a text as TOML has it; what JSON escapes, TOML does in the same way."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _comment(text: str) -> str:
    """Return a text of others for a comment, where only what can be printed may stand."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
