"""The structure of devices: channels, bays and axes, for both threads and asyncio."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import FunctionType
from typing import TYPE_CHECKING, Any, ClassVar, Final, Generic, Never, TypeVar

from stagewire._codec.flags import Enumeration
from stagewire._codec.message import Message
from stagewire._devices.arguments import number_of, with_keywords
from stagewire._devices.connection import Connection
from stagewire._devices.endpoint import CONTROLLER, Endpoint
from stagewire._devices.identity import check_number, described_identity
from stagewire._devices.options import OpenOptions, choose
from stagewire._devices.readiness import advice
from stagewire._devices.scales import Scales
from stagewire._devices.stages import Name, Place
from stagewire._devices.unit import Facts, Unit, commanded
from stagewire._devices.values import Values
from stagewire.errors import BadValueError, OutOfRangeError

_KINDS: Final = {"rack": ("bay", "bays"), "line": ("axis", "axes")}


class PartBase:
    """Part of a device that has calls: the device itself, a bay, a channel or an axis."""

    _parts: ClassVar[tuple[str, str]] = ("", "")
    """Attribute with the class of the parts that this one has, and a call that returns one of them."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        for name, value in tuple(vars(cls).items()):
            if name.startswith("_"):
                continue
            if isinstance(value, FunctionType):
                setattr(cls, name, with_keywords(value))
            elif isinstance(value, classmethod):
                setattr(cls, name, classmethod(with_keywords(value.__func__)))

    def __init__(self, at: Endpoint[Any]) -> None:
        self._at = at

    def __setattr__(self, name: str, value: object) -> None:
        """Set an attribute that the class has or declares; a misspelt name raises an error."""
        found = getattr(type(self), name, None)
        if isinstance(found, property) and found.fset is None:
            call = f"; use set_{name}()" if hasattr(self, f"set_{name}") else ""
            what = f"{name} of {type(self).__name__} cannot be assigned{call}"
            raise AttributeError(what, name=name, obj=self)
        if name.startswith("_") or _has(type(self), name):
            object.__setattr__(self, name, value)
            return
        near = _near(name, [one for one in dir(type(self)) if not one.startswith("_")])
        meant = f"; did you mean {', '.join(near)}?" if near else ""
        what = f"{type(self).__name__} has no attribute {name!r} that can be set{meant}"
        raise AttributeError(what, name=name, obj=self)

    if not TYPE_CHECKING:  # otherwise type checkers would accept any name

        def __getattr__(self, name: str) -> Never:
            attribute, call = self._parts
            inside = getattr(type(self), attribute, None)
            has_it = not name.startswith("_") and hasattr(inside, name)
            why = f"; use {call}.{name}" if has_it else ""
            if name == "stop" and not why:
                why = (
                    "; stop() of the device ends the loops and outputs of all channels"
                    if self._at.connection.unit.has_outputs_to_stop
                    else ": none of its messages ends a motion, a loop or an output, so they continue"
                )
            raise AttributeError(f"{type(self).__name__} has no {name}{why}", name=name, obj=self)

    def __repr__(self) -> str:
        return f"<{self._at.name} at {self._at.connection.url}>"

    def __str__(self) -> str:
        at = self._at
        lines = [f"{at.name} at {at.connection.url}"]
        for place, name in at.connection.places.items():
            if place[0] == at.address and at.channel in (None, place[1]):
                first, *others = _channel(at.connection, place)
                lines += [f"  {_name(name)}: {first}", *(f"    {line}" for line in others)]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        from stagewire._devices.notebook import html_of_part

        return html_of_part(self._at.name, str(self), self._at.connection, self._at.place)

    @property
    def _source(self) -> int | None:
        """Source address of the messages of a subscription; None: any."""
        return self._at.address

    def shows_motion(self, status: Values[Any]) -> bool | None:
        """Return whether a status that this part reported shows a motion; None if it cannot show one.

        Nothing is sent. ``is_moving()`` asks the controller.
        """
        moving = self._at.connection.unit.moving.get(type(status.message))
        if moving is None:
            return None
        field, mask = moving
        return bool(getattr(status.message, field) & mask)

    def _places(self) -> dict[str, Endpoint[Any]]:
        """Return the channels, bays or axes of this part by name, such as ``bay 2``; itself, if it is one."""
        at = self._at
        connection = at.connection
        if at.place in connection.places:
            return {"": at}
        here = {place: name for place, name in connection.places.items() if place[0] == at.address}
        return {
            _kind_and_name(connection.unit, name): Endpoint(
                connection,
                *place,
                f"{connection.unit.name} {_kind_and_name(connection.unit, name)}",
            )
            for place, name in (here or connection.places).items()
        }

    @property
    def scales(self) -> Scales:
        """The current scales of this part."""
        return self._at.scales()

    def values(self, message: Message) -> Values[Any] | None:
        """Return the values of a message in engineering units; None if it has none."""
        return self._at.connection.values_of(message, self._at.place)


def _near(name: str, known: list[str]) -> list[str]:
    """Return up to three names that are similar to a name, or contain it."""
    from difflib import get_close_matches

    containing = sorted((one for one in known if name in one), key=len)
    return list(dict.fromkeys([*get_close_matches(name, known, 3), *containing]))[:3]


def _has(cls: type, name: str) -> bool:
    """Return whether a class has an attribute or declares one by an annotation."""
    if hasattr(cls, name):
        return True
    return any(name in vars(base).get("__annotations__", ()) for base in cls.__mro__)


class DeviceBase(PartBase):
    """An open controller."""

    facts: ClassVar[Facts]
    unit: ClassVar[Unit]

    def __init__(self, connection: Connection[Any]) -> None:
        if not isinstance(connection, Connection):
            name = type(self).__name__
            raise BadValueError(f"{name}(…) opens nothing: use {name}.open({connection!r})")
        unit = connection.unit
        channel = 1 if unit.kind in ("generic_usb", "bay") and unit.channels == 1 else None
        super().__init__(Endpoint(connection, connection.addresses[0], channel, unit.name))

    @property
    def _source(self) -> int | None:
        """The address of a module, whose line others may share; None for other devices."""
        return self._at.address if self.unit.kind == "bay" else None

    @property
    def url(self) -> str:
        """The URL of the line."""
        return self._at.connection.url

    @property
    def info(self) -> Values[Any] | None:
        """The identity that the controller reported when it was opened; None if it was not asked."""
        return self._at.connection.info

    @property
    def serial_number(self) -> int | None:
        """The serial number of the controller; None if it was not asked."""
        return None if self.info is None else getattr(self.info.message, "serial_number", None)

    def __str__(self) -> str:
        return description(self._at.connection)

    def _repr_html_(self) -> str:
        from stagewire._devices.notebook import html_of_part

        return html_of_part(self._at.name, str(self), self._at.connection, None)


P = TypeVar("P", bound=PartBase)


class ChannelsBase(PartBase, Generic[P]):
    """A part with several channels."""

    channel_class: type[P]
    _parts = ("channel_class", "channel(1)")

    def __init__(self, at: Any) -> None:
        super().__init__(at)
        here = self._at
        self._channels = tuple(
            self.channel_class(
                Endpoint(here.connection, here.address, ident, f"{here.name} channel {number}")
            )
            for number, ident in enumerate(here.connection.unit.channel_idents, 1)
        )

    @property
    def channels(self) -> tuple[P, ...]:
        """All channels, starting with channel 1."""
        return self._channels

    def channel(self, number: int | str) -> P:
        """Return a channel by its number, counted from 1, or its name in the enumeration, such as ``CHAN2``.

        An integer is always the number of a channel, also if messages name channels by other values.

        Raise :class:`~stagewire.errors.OutOfRangeError` for a number without a channel, and
        :class:`~stagewire.errors.BadValueError` for anything else.
        """
        unit = self._at.connection.unit
        names = unit.idents or self._at.connection.facts.channels
        if unit.idents is not None and isinstance(number, str | Enumeration):
            ident = number_of(names, number)
            if ident in unit.channel_idents:
                return self._channels[unit.channel_number(ident) - 1]
        return _numbered("channel", self._channels, number, self._at.name, names)


class BaysBase(DeviceBase, Generic[P]):
    """A rack: a motherboard, and controllers in bays."""

    bay_class: type[P]
    _parts = ("bay_class", "bay(1)")

    def __init__(self, connection: Connection[Any]) -> None:
        super().__init__(connection)
        unit = connection.unit
        channel = 1 if unit.channels == 1 else None
        self._bays = tuple(
            self.bay_class(Endpoint(connection, address, channel, f"{unit.name} bay {number}"))
            for number, address in enumerate(unit.bays, 1)
        )

    @property
    def bays(self) -> tuple[P, ...]:
        """All bays, starting with bay 1, including empty bays."""
        return self._bays

    def bay(self, number: int) -> P:
        """Return a bay by its number: ``bay(1)`` has the address 0x21, ``bay(2)`` has 0x22.

        Raise :class:`~stagewire.errors.OutOfRangeError` for a number without a bay, and
        :class:`~stagewire.errors.BadValueError` for anything else. Names are refused, because the
            enumerations of the document count bays from 0.
        """
        return _numbered("bay", self._bays, number, self._at.name)


class AxesBase(DeviceBase, Generic[P]):
    """A controller of axes, whose commands have no frame."""

    axis_class: type[P]
    _parts = ("axis_class", "axis('X')")

    def __init__(self, connection: Connection[Any]) -> None:
        super().__init__(connection)
        self._axes: dict[int, P] = {}

    def axis(self, axis: int | str) -> P:
        """Return an axis by its name, such as ``X``, or its identifier.

        Controllers can be configured with undocumented identifiers, so every valid byte is accepted. Raise
        :class:`~stagewire.errors.OutOfRangeError` for an invalid identifier, and
        :class:`~stagewire.errors.BadValueError` for an unknown name.
        """
        protocol = commanded(self.facts)
        if (number := number_of(None, axis)) is not None:  # also an integer of NumPy
            axis = number
        if isinstance(axis, str):
            if axis.upper() not in protocol.axes:
                known = ", ".join(protocol.axes)
                raise BadValueError(f"{self._at.name} has no axis {axis!r} (choose {known})")
            axis = protocol.axes[axis.upper()]
        identifier = protocol.marks.axis(axis)
        if identifier not in self._axes:
            connection = self._at.connection
            name = connection.places.get((identifier, None), f"{identifier:#04x}")
            endpoint = Endpoint(connection, identifier, None, f"{self._at.name} axis {name}")
            self._axes[identifier] = self.axis_class(endpoint)
        return self._axes[identifier]


def _numbered(
    kind: str,
    parts: tuple[P, ...],
    number: object,
    owner: str,
    names: type[Enumeration] | None = None,
) -> P:
    found = number_of(names, number)
    if found is None:
        known = "".join(f", {name}" for name in (names.__members__ if names else ()))
        raise BadValueError(
            f"{owner} {kind} {number!r} is not one of {', '.join(map(str, range(1, len(parts) + 1)))}{known}"
        )
    if not 1 <= found <= len(parts):
        raise OutOfRangeError(f"{owner} has {kind}s 1 to {len(parts)}, not {found}")
    return parts[found - 1]


def url_of(link: object) -> str:
    """Return the URL of an open link, or the URL to open.

    Raise :class:`~stagewire.errors.BadValueError` for anything else.
    """
    url = link if isinstance(link, str) else getattr(link, "url", None)
    if not isinstance(url, str):
        raise BadValueError(
            f"open requires a URL or the name of a port as text, or an open link, not {link!r}"
        )
    return url


def connect(
    cls: type[DeviceBase], url: str, given: OpenOptions, bay: int | None
) -> Connection[Any]:
    """Return the connection of a controller, before its line is opened.

    :param bay: bay of a module in its rack; None: the first.

    Raise the errors of :func:`~stagewire._devices.options.choose`,
    :class:`~stagewire.errors.WrongUnitError` for the serial number of another unit, and
    :class:`~stagewire.errors.OutOfRangeError` for a bay that does not exist.
    """
    facts, unit = cls.facts, cls.unit
    if bay is None:
        bay = 1
    elif unit.kind != "bay":
        raise BadValueError(f"bay: a {unit.name} is not a module of a rack; leave it out")
    if issubclass(cls, AxesBase):
        places: Mapping[Place, Name] = {
            (axis, None): name for name, axis in commanded(facts).axes.items()
        }
        addresses: tuple[int, ...] = (CONTROLLER,)
    elif unit.kind == "rack":
        addresses = (unit.address, *unit.bays)
        places = {
            (address, ident): number if unit.channels == 1 else (number, channel)
            for number, address in enumerate(unit.bays, 1)
            for channel, ident in enumerate(unit.channel_idents, 1)
        }
    else:
        if unit.kind == "bay" and (
            isinstance(bay, bool) or bay not in range(1, len(unit.bays) + 1)
        ):
            raise OutOfRangeError(f"a rack has bays 1 to {len(unit.bays)}, not {bay!r}")
        documented = unit.bays[bay - 1] if unit.kind == "bay" else unit.address
        address = given.get("address")
        addresses = (documented if address is None else address,)
        places = {
            (addresses[0], ident): channel for channel, ident in enumerate(unit.channel_idents, 1)
        }
    if given.get("address") is not None and unit.kind not in ("generic_usb", "bay"):
        raise BadValueError(
            f"address: a {unit.name} always has its documented addresses; leave it out"
        )
    choices = choose(facts, unit, tuple(places.values()), given)
    if choices.identify:
        check_number(facts, unit, url, choices.serial_number)
    return Connection(facts, unit, url, choices, dict(places), addresses)


def description(connection: Connection[Any]) -> str:
    """Return several lines: unit, identity, and the stage, limits and scales of each channel."""
    return "\n".join(_lines(connection))


def _lines(connection: Connection[Any]) -> Iterator[str]:
    unit = connection.unit
    yield f"{unit.name}: {unit.title}, at {connection.url}"
    for line in described_identity(connection):
        yield f"  {line}"
    alike: dict[tuple[str, ...], list[str]] = {}
    for place, name in connection.places.items():
        alike.setdefault(_channel(connection, place), []).append(_name(name))
    kind, kinds = _KINDS.get(unit.kind, ("channel", "channels"))
    for lines, names in alike.items():
        yield f"  {kind if len(names) == 1 else kinds} {', '.join(names)}: {lines[0]}"
        for line in lines[1:]:
            yield f"    {line}"


def _name(name: Name) -> str:
    return f"{name[0]} channel {name[1]}" if isinstance(name, tuple) else str(name)


def _kind_and_name(unit: Unit, name: Name) -> str:
    """Return the name of a channel, bay or axis for people, such as ``bay 2``."""
    kind, _ = _KINDS.get(unit.kind, ("channel", ""))
    return f"{kind} {_name(name)}"


def _channel(connection: Connection[Any], place: Place) -> tuple[str, ...]:
    """Return the lines for a channel: its stage, what prevents motions, its limits and scales."""
    scales, unit = connection.scales(place), connection.unit
    limits = connection.stated_limits(place)
    state = (
        f"motions are refused: {'; '.join(faults)}; {advice(unit, needed, faults, scales, limits)}"
        for needed, faults in connection.readiness.faults(place).items()
    )
    return (
        connection.stages.described(place),
        *state,
        *limits.described(unit.settable, scales),
        *scales.described(unit.quantities),
    )
