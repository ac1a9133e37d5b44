"""Sets of parameters of a controller, such as velocity parameters, as signals."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from functools import partial
from typing import Any, Final

from ophyd_async.core import SignalMetadata, SignalR, SignalRW, StandardReadable
from ophyd_async.core import StandardReadableFormat as Format

from stagewire.devices import Parameter, ParameterKind, parameter_sets
from stagewire_bluesky.controller import Reference
from stagewire_bluesky.signals import PartBackend

_RESERVED: Final = ("name", "parent", "set", "stage", "stop", "trigger")
"""Attributes that a device of ophyd-async cannot have for a child."""


def child_name(name: str) -> str:
    """Return the attribute for a parameter or set: its name, or ``trigger_`` for ``trigger``."""
    return f"{name}_" if name in _RESERVED else name


class Parameters(StandardReadable):
    """One set of parameters, with a signal for each; all are part of the configuration.

    ``motor.vel_params.max_velocity`` is the velocity in the unit of the stage. Setting it reads the set,
    replaces one value and writes the set: one ``change_vel_params``. A number whose scale is unknown is in
    counts. An enumeration is the name of its value; bits are the names of those that are set.

    :param reference: the part with the parameters.
    :param set_name: name of the set, such as ``vel_params`` for ``get_vel_params``.

    Raise :class:`TypeError` for a part without this set, and for a set whose request requires an argument.
    """

    def __init__(self, reference: Reference, set_name: str, name: str = "") -> None:
        sets = parameter_sets(reference.kind)
        if set_name not in sets:
            reference.require(f"get_{set_name}", f"holder of {set_name}")
        self._set = sets[set_name]
        if self._set.arguments:
            raise TypeError(
                f"{set_name} cannot be signals: a request for it requires {', '.join(self._set.arguments)}"
            )
        self._under_way: asyncio.Future[Any] | None = None
        with self.add_children_as_readables(Format.CONFIG_SIGNAL):
            for one in self._set.parameters.values():
                signal = self._signal(reference, one)
                setattr(self, child_name(one.name), signal)
        super().__init__(name=name)

    def _signal(self, reference: Reference, one: Parameter) -> SignalR[Any] | SignalRW[Any]:
        write = partial(self._write, one) if one.changeable else None
        backend: PartBackend[Any] = PartBackend(
            reference, datatype(one), partial(self._read, one), write, partial(metadata, one)
        )
        return SignalRW(backend) if one.changeable else SignalR(backend)

    async def _read(self, one: Parameter, part: Any) -> Any:
        """Request the set, once for all signals that are read at the same time."""
        if self._under_way is None or self._under_way.done():
            self._under_way = asyncio.ensure_future(getattr(part, self._set.read)())
        value = one.plain(await asyncio.shield(self._under_way))
        return list(value) if isinstance(value, tuple) else value

    async def _write(self, one: Parameter, part: Any, value: Any) -> None:
        assert self._set.change is not None  # otherwise the signal is read-only
        await getattr(part, self._set.change)(**one.keyword(value, part.scales))
        self._under_way = None  # a request that was sent before has the old value


def datatype(one: Parameter) -> type[Any]:
    """Return the type of the signal of a parameter."""
    if one.kind is ParameterKind.NUMBER:
        return float if one.scaled else int
    return Sequence[str] if one.kind is ParameterKind.BITS else str


def metadata(one: Parameter, part: Any) -> SignalMetadata:
    """Return the unit of a number that has one."""
    return SignalMetadata(units=one.now(part.scales)[1]) if one.scaled else SignalMetadata()
