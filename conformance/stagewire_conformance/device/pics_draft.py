"""Draft a PICS by querying a controller, and write it as TOML with comments. Nothing is set or moved.

The draft reads the identity and the bays, and then sends every request of the unit. A request without a reply
is sent a second time, and then listed as unsupported. The vendor adds the rest by hand.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any, Final, NamedTuple

from stagewire.discovery import Known, by_name, by_serial_number
from stagewire.errors import StagewireError
from stagewire.links import Link
from stagewire.protocols import (
    Command,
    CommandProtocol,
    FramedProtocol,
    available_protocols,
    load_protocol,
)
from stagewire_conformance.device.declaration import (
    Declaration,
    axes_of,
    declare,
    facts_of,
    issues_of,
)
from stagewire_conformance.device.errors import NothingAnswersError
from stagewire_conformance.device.lines.apt_line import AptLine
from stagewire_conformance.device.lines.command_line import CommandLine
from stagewire_conformance.device.permissions import COUNTS, Permissions
from stagewire_conformance.device.pics import BayPics, ChannelPics, Pics
from stagewire_conformance.device.targets import RACK, Target


def pics_text(
    pics: Pics, declared: Declaration, url: str, identity: Mapping[str, int | str]
) -> str:
    """Return the text of a PICS.

    :param declared: the controller that ``pics`` declares.
    :param url: of the line to the controller.
    :param identity: what the controller reported about itself.
    """
    return "\n".join(_lines(pics, declared, url, identity)) + "\n"


def _lines(
    pics: Pics, declared: Declaration, url: str, identity: Mapping[str, int | str]
) -> Iterator[str]:
    is_of_commands = isinstance(declared.protocol, CommandProtocol)
    yield f"# Drafted from the answers of the {pics.unit} at {_comment(url)}."
    for name, value in identity.items():
        yield f"# {name}: {_comment(str(value).strip())}"
    yield "# Correct this draft. The suite skips the messages under [unsupported], and nothing else."
    yield ""
    yield "schema_version = 1"
    yield f"protocol = {_text(declared.protocol.name)}"
    yield f"unit = {_text(pics.unit)}"
    if not pics.motherboard:
        yield "motherboard = false              # nothing answers at its address"
    later = issues_of(declared.protocol, pics.unit)[1:]
    if later and any(place.later for place in declared.places):
        yield f"# issue = {_text(later[-1])}                   # if the firmware follows this issue"
    if is_of_commands:
        yield '# firmware = "3.3"'
    else:
        yield f'line = {_text(pics.line)}                     # or "rs232", without keep-alive messages'
    yield from _reasons("unsupported", pics.unsupported)
    for bay in pics.bays or ():
        yield from ("", "[[bay]]", f"number = {bay.number}")
        if bay.unit:
            yield f"unit = {_text(bay.unit)}"
        yield from _reasons("bay.unsupported", bay.unsupported)
    for channel in pics.channels:
        yield from _channel(channel, declared, is_of_commands)
    yield from (
        "",
        "# [timing]",
        "# reply_p99_ms = 50            # optional: 99 of 100 replies arrive within this time",
    )


def _channel(channel: ChannelPics, declared: Declaration, is_of_commands: bool) -> Iterator[str]:
    yield from ("", "[[channel]]")
    if channel.bay is not None:
        yield f"bay = {channel.bay}"
    if channel.axis is not None:
        yield f"axis = {_text(channel.axis)}"
    else:
        yield f"number = {channel.number}"
    if is_of_commands:
        yield '# travel = "-50..50mm"          # travel of the stage'
        return
    place = next(
        each for each in declared.places if each.channels and each.bay in (channel.bay, 1, None)
    )
    stages = place.unit.stages
    yield (
        f'# stage = "{stages[0]}"'
        if stages
        else '# counts_per_mm = "25600"        # scale of the stage'
    )
    yield f'# travel = "0..12mm"           # travel of the stage; or in {COUNTS}: "0..400000{COUNTS}"'
    yield "# homes = true                 # whether the stage can home"
    yield "# limit_switches = true"


def _reasons(header: str, reasons: Mapping[str, str]) -> Iterator[str]:
    if reasons:
        yield from ("", f"[{header}]")
    for name, reason in reasons.items():
        yield f"{name} = {_text(reason)}"


def _text(value: str) -> str:
    """Return a string in TOML syntax. TOML and JSON use the same escapes."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _comment(text: str) -> str:
    """Return text for a comment, with unprintable characters replaced."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


_WAIT: Final = 0.5
"""Seconds to wait for an answer, for each of two attempts."""

_SILENT: Final = "did not answer"

_OCCUPIED: Final = 1
"""State of an occupied bay of a rack."""

Say = Callable[[str], None]
"""Called with a description of each request, for a progress display."""


def ask_pics(link: Link, unit: str = "", say: Say = lambda about: None) -> str:
    """Query a controller and return a PICS as the text of a TOML file.

    :param unit: its name; empty to read it from the controller, if the protocol supports that.
    :param say: called with a description of each request.

    Raises :class:`~stagewire.errors.StagewireError` for a unit that is unknown or cannot be determined,
    and :class:`.NothingAnswersError` if the controller does not answer.
    """
    declared = declare(unit or _reported_unit(link))
    if isinstance(declared.protocol, CommandProtocol):
        return _Axes(CommandLine(link, declared, Permissions()), say).text()
    line = AptLine(link, declared, Permissions())
    with line.silent():  # send requests only, without keep-alive messages
        return _Addresses(line, link, say).text()


class Draft(NamedTuple):
    """A PICS drafted from a controller.

    :param text: of the TOML file. It begins with a comment if there is a doubt.
    :param doubt: why the controller may be another unit than the named one; empty if there is no doubt.
    """

    text: str
    doubt: str


def draft_pics(link: Link, unit: str = "", say: Say = lambda about: None) -> Draft:
    """Draft a PICS, and check that the controller is the named unit. See :func:`ask_pics`."""
    text = ask_pics(link, unit, say)
    doubt = contradiction(link, unit) if unit else ""
    return Draft(f"# Doubtful: {_comment(doubt)}.\n{text}" if doubt else text, doubt)


def contradiction(link: Link, unit: str) -> str:
    """Return a description of the reported unit if it differs from the named one, or an empty string.

    :param unit: the named unit. Without an identity message in its protocol, nothing is compared.

    Raises :class:`~stagewire.errors.StagewireError` if the controller does not answer.
    """
    declared = declare(unit)
    if not isinstance(declared.protocol, FramedProtocol):
        return ""
    line = AptLine(link, declared, Permissions())
    with line.silent():
        reported = line.contact()
    model = str(reported.get("model_number", "")).strip()
    serial_number = str(reported.get("serial_number", ""))
    units = {each.unit for each in _known(declared, model, serial_number)}
    if not units - {None} or declared.unit.name in units:
        return ""
    return (
        f"--unit {declared.unit.name} was given, but the controller reports that it is a "
        f"{model} with the serial number {serial_number}"
    )


def _known(declared: Declaration, model: str, serial_number: str) -> list[Known]:
    """Return the units that match the model, or otherwise the serial number."""
    found = by_name(declared.protocol, model)
    return [found] if found else by_serial_number(declared.protocol, serial_number)


def _reported_unit(link: Link) -> str:
    """Return the unit that a controller reports."""
    asked = []
    for name in available_protocols():
        protocol = load_protocol(name)
        if not isinstance(protocol, FramedProtocol) or facts_of(protocol).identity is None:
            continue
        units = facts_of(protocol).units.values()
        bays = {
            bay for unit in units for bay in unit.bays
        }  # in a rack, the card there would answer
        of_address = {unit.address: unit.name for unit in units if unit.address not in bays}
        for address, some in sorted(of_address.items(), reverse=True):
            line = AptLine(link, declare(some), Permissions())
            asked.append(f"{address:#04x}")
            with line.silent():
                identity = _identity(line, address)
            if identity is not None:
                return _unit_of(line.declared, identity)
    raise NothingAnswersError(
        f"no controller at {link.url} identifies itself (tried {', '.join(asked)}). Check that it is "
        "switched on, and that this is its port. For a protocol without an identity message, give --unit"
    )


def _identity(line: AptLine, address: int) -> Any:
    """Return the identity message of the controller at an address; None without an answer."""
    identity = line.declared.facts.identity
    assert identity is not None
    assert identity.req is not None
    request: Any = identity.req
    for _ in range(2):
        heard = line.ask(request(), address, _WAIT)
        if heard is not None:
            return heard.message
    return None


def _unit_of(declared: Declaration, identity: Any) -> str:
    """Return the documented unit of an identity, also for a later unit that uses the same messages."""
    model = identity.model_number.strip()
    if model.upper() == RACK:
        return RACK
    units = {each.unit for each in _known(declared, model, str(identity.serial_number))}
    if len(units) == 1 and (unit := units.pop()) is not None:
        return unit
    likely = f" (one of {', '.join(sorted(filter(None, units)))})" if units else ""
    raise StagewireError(
        f"the controller reports the model {model!r} and the serial number {identity.serial_number}, which "
        f"identify no documented unit{likely}; give --unit (a rack of modules is {RACK})"
    )


class _Addresses:
    """Queries a controller with addresses."""

    def __init__(self, line: AptLine, link: Link, say: Say) -> None:
        self._line = line
        self._link = link
        self._say = say

    def text(self) -> str:
        """Return the text of the PICS."""
        identity = self._line.contact()
        pics = replace(self._line.declared.pics, bays=self._bays())
        if pics.bays == () and not identity:
            pics = replace(pics, bays=self._bays_alone(), motherboard=False)
        declared = declare(pics)
        line = AptLine(self._link, declared, Permissions())
        with line.silent():
            silent = {
                place.address: frozenset(self._silent(line, place)) for place in declared.places
            }
        return pics_text(_with(declared, silent), declared, self._link.url, identity)

    def _bays(self) -> tuple[BayPics, ...] | None:
        """Return the occupied bays; None if the unit is not a rack."""
        unit = self._line.declared.unit
        if unit.kind != "rack":
            return None
        facts = self._line.declared.facts
        used = facts.bay_used
        assert used is not None
        modules = [each for each in facts.units.values() if each.kind == "bay"]
        addresses = modules[0].bays if unit.name == RACK else unit.bays
        bays = []
        for number, address in enumerate(addresses, 1):
            self._say(f"bay {number}")
            request: Any = used.req
            message = request(
                **{used.asked[0].keyword: number - 1}
            )  # counted from zero on the wire
            heard = self._line.ask(message, unit.address, _WAIT)
            if heard is not None and heard.message.bay_state == _OCCUPIED:
                bays.append(BayPics(number=number, unit=self._module(address)))
        return tuple(bays)

    def _bays_alone(self) -> tuple[BayPics, ...]:
        """Return the bays that identify themselves, if no motherboard answers."""
        return tuple(
            BayPics(number=number)
            for number, address in enumerate(self._line.declared.unit.bays, 1)
            if _identity(self._line, address) is not None
        )

    def _module(self, address: int) -> str:
        """Return the module in a bay of a rack of modules; empty for a card of the rack."""
        if self._line.declared.unit.name != RACK:
            return ""
        identity = _identity(self._line, address)
        if identity is None:
            raise NothingAnswersError(
                f"the rack reports that the bay at {address:#04x} is occupied, but nothing answers there"
            )
        return _unit_of(self._line.declared, identity)

    def _silent(self, line: AptLine, place: Target) -> Iterator[str]:
        """Yield the requests of a place that are not answered on any of its channels."""
        for name in sorted(place.listed):
            entry = line.declared.registry.messages[name]
            if entry["effect"] != "none" or not entry["exchange"].get("answered_by"):
                continue
            self._say(f"{place.name} {name}")
            requests = [
                line.declared.request(name, channel) for channel in place.channels or (None,)
            ]
            if not any(
                line.ask(request, place.address, _WAIT) for request in (*requests, *requests)
            ):
                yield name


def _with(declared: Declaration, silent: dict[int, frozenset[str]]) -> Pics:
    """Return a PICS that lists unanswered requests as unsupported: by all places, or by one bay."""
    reasons: dict[str, str] = {}
    for name in sorted(frozenset[str]().union(*silent.values())):
        if all(name in silent[each.address] for each in declared.places if name in each.listed):
            reasons[name] = _SILENT
    bays = declared.pics.bays
    if bays is not None:
        of_bay = {each.bay: each for each in declared.places}
        bays = tuple(
            replace(
                bay,
                unsupported=dict.fromkeys(
                    sorted(silent[of_bay[bay.number].address] - reasons.keys()), _SILENT
                ),
            )
            for bay in bays
        )
    channels = tuple(
        ChannelPics(number=number, bay=place.bay if bays is not None else None)
        for place in declared.places
        for number, _ in enumerate(place.channels, 1)
        if place.moves_stages
    )
    return replace(declared.pics, unsupported=reasons, bays=bays, channels=channels)


class _Axes:
    """Queries a controller with axes."""

    def __init__(self, line: CommandLine, say: Say) -> None:
        self._line = line
        self._say = say

    def text(self) -> str:
        """Return the text of the PICS."""
        identity = self._line.contact()
        try:
            pics = self._ask()
        finally:
            self._line.leave()
        return pics_text(pics, declare(pics), self._line.url, identity)

    def _ask(self) -> Pics:
        declared = self._line.declared
        requests = {
            cls.layout.message: cls()
            for cls in declared.protocol.messages
            if issubclass(cls, Command) and cls.reply is not None and not cls.layout.dummy
        }
        assert isinstance(declared.protocol, CommandProtocol)
        answered: dict[str, set[str]] = {}
        for axis, identifier in axes_of(declared.protocol).items():
            for name, request in requests.items():
                self._say(f"{axis} {name}")
                if self._line.ask(request, identifier, _WAIT):
                    answered.setdefault(axis, set()).add(name)
                elif name == next(iter(requests)):
                    break  # this axis does not exist
        silent = requests.keys() - set[str]().union(*answered.values())
        return replace(
            declared.pics,
            unsupported=dict.fromkeys(sorted(silent), _SILENT),
            channels=tuple(ChannelPics(axis=axis) for axis in answered),
        )
