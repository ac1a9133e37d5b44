"""Bench files: which controllers an IOC opens, and which records it publishes for them.

A bench is a TOML file::

    prefix = "LAB:"                       # begins the name of every record
    autosave = "lab.json"                 # optional: keeps coordinates and limits, for --restore

    [controllers.rack]
    unit = "BBD102"
    url = "usb://73000001"
    stage = "MLS203"                      # this, and any other option of open()
    travel_mm = 110

    [motors.x]                            # the motor record LAB:x
    controller = "rack"
    bay = 1
    description = "across the beam"
    parameters = ["vel_params"]           # LAB:x:VEL_PARAMS:MAX_VELOCITY and others; "all" for all
    status = true                         # LAB:x:STATUS:HOMED and others

    [parts.focus]                         # a part without a motor, such as a piezo
    controller = "piezo"
    parameters = "all"

    [access]                              # optional: others can only read and stop
    hosts = ["beamline"]
    users = ["operator"]
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)

from stagewire.devices import OpenOptions
from stagewire.discovery import device_class
from stagewire.errors import BadValueError, StagewireError

_NAME: Final = re.compile(r"[A-Za-z0-9_-]+(:[A-Za-z0-9_-]+)*")
_LONGEST: Final = 40
"""Characters of a name, so that all records of a motor fit the 60 characters of Channel Access."""
_FIXED: Final = {"background", "identify", "on_close", "log"}
"""Options of ``open`` that an IOC does not offer."""


_WORDS: Final = {"extra_forbidden": "unknown key", "missing": "missing; add this key"}
"""Type of an error of pydantic -> our words for it."""


class BenchError(StagewireError):
    """A bench file is invalid."""


def _checked_name(name: str) -> str:
    if not _NAME.fullmatch(name) or len(name) > _LONGEST:
        raise ValueError(
            f"expected up to {_LONGEST} letters, digits, underscores and hyphens, with single colons between "
            "them"
        )
    return name


def _checked_sets(value: Any) -> Any:
    if value != "all" and not isinstance(value, list):
        raise ValueError('expected "all", or a list of parameter sets such as ["vel_params"]')
    return value


def _checked_limits(limits: list[float]) -> list[float]:
    if len(limits) != 2 or limits[0] >= limits[1]:
        raise ValueError("expected the lower and the upper limit, such as [0, 25]")
    return limits


_Name = Annotated[str, AfterValidator(_checked_name)]
_Positive = Annotated[float, Field(gt=0)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class ControllerTable(BaseModel):
    """A table ``[controllers.NAME]``; all other keys are options of ``open``."""

    model_config = ConfigDict(extra="allow", frozen=True, strict=True)
    unit: str
    url: str

    @model_validator(mode="after")
    def _check(self) -> ControllerTable:
        try:
            device_class(self.unit)
        except BadValueError as error:
            raise ValueError(str(error)) from None
        known = set(OpenOptions.__annotations__) - _FIXED
        for name in self.options:
            if name not in known:
                raise ValueError(
                    f"unknown option {name}; options of open are {', '.join(sorted(known))}"
                )
        return self

    @property
    def options(self) -> dict[str, Any]:
        """The options of ``open``."""
        return {
            name: tuple(value) if isinstance(value, list) else value
            for name, value in (self.model_extra or {}).items()
        }


class PartTable(_Table):
    """A table ``[parts.NAME]``: a part of a controller with parameters.

    :param controller: name of a controller of the bench.
    :param bay: bay of a rack, from 1.
    :param channel: channel of a controller or bay with several, from 1.
    :param axis: axis of an MS-2000.
    :param parameters: sets of parameters to publish, or ``all``.
    :param status: whether to publish each bit of the status.
    """

    controller: str
    bay: int | None = None
    channel: int | None = None
    axis: str | None = None
    parameters: Annotated[list[str] | Literal["all"], BeforeValidator(_checked_sets)] = []
    status: bool = False

    @property
    def steps(self) -> tuple[tuple[str, int | str], ...]:
        """The names of the calls, with their arguments, that lead from the controller to the part."""
        steps = (("bay", self.bay), ("channel", self.channel), ("axis", self.axis))
        return tuple((name, value) for name, value in steps if value is not None)


class MotorTable(PartTable):
    """A table ``[motors.NAME]``: a part that is published as a motor record.

    :param description: text of DESC, up to the 39 characters of Channel Access.
    :param velocity: units per second, if the controller does not report it.
    :param acceleration_time: seconds from rest to the velocity, if the controller does not report it.
    :param limits: lower and upper limit in units of the stage; default: the travel.
    :param highest_velocity: highest velocity that clients may set, in units per second; default: that of the
        controller when it is opened.
    """

    description: Annotated[str, Field(max_length=39)] = ""
    velocity: _Positive | None = None
    acceleration_time: _Positive | None = None
    limits: Annotated[list[float], AfterValidator(_checked_limits)] | None = None
    highest_velocity: _Positive | None = None


class AccessTable(_Table):
    """The table ``[access]``: the clients that may put values; empty: all."""

    hosts: list[str] = []
    users: list[str] = []


class Bench(_Table):
    """A bench.

    :param prefix: begins the name of every record.
    :param autosave: file for coordinates and limits, relative to the bench.
    """

    prefix: Annotated[str, Field(max_length=30, pattern=r"^([A-Za-z0-9_-]+:)*$")] = ""
    autosave: str | None = None
    controllers: dict[_Name, ControllerTable]
    motors: dict[_Name, MotorTable] = {}
    parts: dict[_Name, PartTable] = {}
    access: AccessTable = AccessTable()

    @model_validator(mode="after")
    def _check(self) -> Bench:
        tables = [*self.motors.items(), *self.parts.items()]
        if not tables:
            raise ValueError("expected at least one table, such as [motors.x]")
        used: dict[tuple[Any, ...], str] = {}
        for name, table in tables:
            if table.controller not in self.controllers:
                raise ValueError(
                    f"{name}: unknown controller {table.controller!r}; expected one of "
                    f"{', '.join(self.controllers)}"
                )
            first = used.setdefault((table.controller, table.steps), name)
            if first != name or (name in self.motors and name in self.parts):
                raise ValueError(f"{name} and {first} are the same part or have the same name")
        unused = self.controllers.keys() - {table.controller for _, table in tables}
        if unused:
            raise ValueError(
                f"controllers.{min(unused)} has no motor and no part; add one, or remove it"
            )
        return self


def read_bench(path: Path) -> Bench:
    """Read a bench file.

    Raise :class:`BenchError`, which names the file, each wrong key and the expected value.
    """
    try:
        return Bench.model_validate(tomllib.loads(path.read_text("utf-8")))
    except OSError as error:
        raise BenchError(f"{path}: cannot read the bench: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BenchError(f"{path}: not valid TOML: {error}") from None
    except ValidationError as error:
        problems = [
            f"{path}: {'.'.join(map(str, one['loc']))}{': ' if one['loc'] else ''}"
            + (_WORDS.get(one["type"]) or _lower(one["msg"].removeprefix("Value error, ")))
            for one in error.errors()
        ]
        raise BenchError("\n".join(problems)) from None


def _lower(text: str) -> str:
    return text[:1].lower() + text[1:]
