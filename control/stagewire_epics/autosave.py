"""Autosave: coordinates and limits of motors in a file, which are restored only on request.

The controller keeps neither, so they are lost when an IOC ends. The velocity is not saved: the controller
keeps it while it is on, and a restored one might be faster than expected.
"""

from __future__ import annotations

import asyncio
import json
import logging
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from stagewire.errors import StagewireError
from stagewire_epics.motor import Motor
from stagewire_epics.records import PutRefusedError, Record

_log = logging.getLogger("stagewire")
SAVED: Final = ("OFF", "DIR", "FOFF", "DLLM", "DHLM", "TWV", "HLSV")
"""The fields that are saved."""
_CHANGING: Final = ("HLM", "LLM", "SET")
"""Other fields whose puts change them; SET is put before a position is set."""
_DELAY: Final = 1.0
"""Seconds from a change until it is saved."""


class AutosaveError(StagewireError):
    """A file of saved values cannot be read or written."""


class Autosave:
    """Saves the fields of motors after each change by a client.

    Values that the IOC itself publishes, such as the limits of the bench at the start, are not saved: they
    would replace those of an earlier run.

    :param path: JSON file. A file of an earlier run is kept as ``PATH.bak``, unless it was restored.
    :param motors: the motors by the name of their record.

    Raise :class:`AutosaveError` if the directory of the file is missing or cannot be written.
    """

    def __init__(self, path: Path, motors: Mapping[str, Motor]) -> None:
        if not os.access(path.parent, os.W_OK):
            raise AutosaveError(
                f"{path}: cannot save: {path.parent} is not a directory that can be written"
            )
        self._path = path
        self._motors = motors
        self._keep_former = path.exists()
        self._saving: asyncio.Task[None] | None = None
        self._saved = 0
        for motor in motors.values():
            for field in SAVED:
                motor.records[field].listen(self._changed)

    def restore(self) -> None:
        """Give the motors the saved values. Nothing moves. Call it before the IOC runs.

        Raise :class:`AutosaveError` for a file that cannot be read, an unknown motor or field, and an
        unusable value.
        """
        try:
            saved = json.loads(self._path.read_text("utf-8"))
        except (OSError, ValueError) as error:
            raise AutosaveError(f"{self._path}: cannot restore: {error}") from None
        if not isinstance(saved, dict):
            raise AutosaveError(
                f"{self._path}: cannot restore: expected an object with motors by name"
            )
        for name, values in saved.items():
            if name not in self._motors or not isinstance(values, dict) or set(values) - set(SAVED):
                raise AutosaveError(
                    f"{self._path}: cannot restore {name}: expected motors of the bench with the fields "
                    f"{', '.join(SAVED)}; correct or remove the entry"
                )
            try:
                self._motors[name].restore(values)
            except PutRefusedError as error:
                raise AutosaveError(f"{self._path}: cannot restore: {error}") from None
        self._keep_former = False

    async def _changed(self, _: Record) -> None:
        if self._puts() > self._saved and (self._saving is None or self._saving.done()):
            self._saving = asyncio.create_task(self._save_later())

    def _puts(self) -> int:
        """Return how many values clients have put into the fields that change what is saved."""
        return sum(
            motor.records[field].puts
            for motor in self._motors.values()
            for field in (*SAVED, *_CHANGING)
        )

    async def _save_later(self) -> None:
        await asyncio.sleep(_DELAY)
        self.save()

    async def close(self) -> None:
        """Save changes that are not saved yet."""
        if self._saving is not None and not self._saving.done():
            self._saving.cancel()
            with suppress(asyncio.CancelledError):
                await self._saving
            self.save()

    def save(self) -> None:
        """Write the file, under a temporary name first. A failure is logged."""
        values: dict[str, dict[str, Any]] = {
            name: {field: motor.records[field].value for field in SAVED}
            for name, motor in self._motors.items()
        }
        puts = self._puts()
        temporary = self._path.with_name(self._path.name + ".new")
        try:
            temporary.write_text(json.dumps(values, indent=1) + "\n", "utf-8")
            if self._keep_former:
                os.replace(self._path, self._path.with_name(self._path.name + ".bak"))
                self._keep_former = False
            os.replace(temporary, self._path)
            self._saved = puts
        except OSError as error:
            _log.warning("%s: cannot save: %s", self._path, error.strerror)
