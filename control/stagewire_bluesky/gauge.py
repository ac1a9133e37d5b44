"""Strain gauges, which are read and cannot be set."""

from __future__ import annotations

from functools import partial
from typing import Any, Final

from ophyd_async.core import SignalR, StandardReadable
from ophyd_async.core import StandardReadableFormat as Format

from stagewire.devices import parameter_sets
from stagewire_bluesky.controller import Reference
from stagewire_bluesky.parameters import Parameters, metadata
from stagewire_bluesky.signals import readable

_READING: Final = "tsg_reading"
_SETTINGS: Final = "tsg_io_settings"


class StrainGauge(StandardReadable):
    """A strain gauge reader (TSG001): its reading, in the unit of its display mode.

    The reading is in µm or N while the display mode is position or force, and their full scale is known;
    otherwise it is in counts. The display mode is part of the configuration.

    :param reference: the controller.
    """

    def __init__(self, reference: Reference, name: str = "") -> None:
        reference.require(f"get_{_READING}", "strain gauge")
        self.reference = reference
        self._set = parameter_sets(reference.kind)[_READING]
        self._reading = self._set.parameters["reading"]
        with self.add_children_as_readables(Format.HINTED_UNCACHED_SIGNAL):
            self.reading: SignalR[float] = readable(
                reference, float, self._read, partial(metadata, self._reading)
            )
        with self.add_children_as_readables():
            self.settings = Parameters(reference, _SETTINGS)
        super().__init__(name=name)

    def set_name(self, name: str, *, child_name_separator: str | None = None) -> None:
        """Name the device; its reading has the same name in documents."""
        super().set_name(name, child_name_separator=child_name_separator)
        self.reading.set_name(name)

    async def _read(self, part: Any) -> float:
        return float(self._reading.plain(await getattr(part, self._set.read)()))
