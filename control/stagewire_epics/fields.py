"""The fields of a motor record, with the names and meanings of the EPICS motor record.

Each has a record ``NAME.FIELD``; ``NAME`` itself is ``NAME.VAL``. A field without a method in
:mod:`stagewire_epics.motor` is read-only. Other fields of the EPICS motor record do not exist here, so that
clients cannot connect to them.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from stagewire_epics.records import Kind

SEVERITIES: Final = ("NO_ALARM", "MINOR", "MAJOR", "INVALID")


class Field(NamedTuple):
    """A field.

    :param name: its name.
    :param kind: type of its value.
    :param value: the first value.
    :param description: its meaning.
    :param choices: texts of a choice.
    :param in_units: whether it has the unit and the precision of positions; ``/s``: of velocities.
    """

    name: str
    kind: Kind
    value: Any
    description: str
    choices: tuple[str, ...] = ()
    in_units: str | None = None


def _position(name: str, description: str, value: float = 0.0) -> Field:
    return Field(name, Kind.FLOAT, value, description, in_units="")


def _velocity(name: str, description: str) -> Field:
    return Field(name, Kind.FLOAT, 0.0, description, in_units="/s")


def _float(name: str, description: str, value: float = 0.0) -> Field:
    return Field(name, Kind.FLOAT, value, description)


def _integer(name: str, description: str, value: int = 0) -> Field:
    return Field(name, Kind.INTEGER, value, description)


def _text(name: str, description: str, value: str = "") -> Field:
    return Field(name, Kind.TEXT, value, description)


def _choice(name: str, description: str, choices: tuple[str, ...], value: int = 0) -> Field:
    return Field(name, Kind.CHOICE, value, description, choices)


FIELDS: Final = (
    # Positions
    _position("VAL", "target in user coordinates"),
    _position("DVAL", "target in dial coordinates, those of the controller"),
    _integer("RVAL", "target in counts"),
    _position("RLV", "distance of a relative move"),
    _position("RBV", "position in user coordinates"),
    _position("DRBV", "position in dial coordinates"),
    _integer("RRBV", "position in counts"),
    _position("DIFF", "target minus position, in dial coordinates"),
    # Coordinates
    _position("OFF", "user coordinate of the dial position 0"),
    _choice("DIR", "direction of user coordinates", ("Pos", "Neg")),
    _choice("FOFF", "whether setting a position changes OFF or the controller", ("Variable", "Frozen")),
    _choice("SET", "whether a target moves, or sets the position", ("Use", "Set")),
    # Limits
    _position("HLM", "upper limit in user coordinates"),
    _position("LLM", "lower limit in user coordinates"),
    _position("DHLM", "upper limit in dial coordinates"),
    _position("DLLM", "lower limit in dial coordinates; both 0: no limits"),
    _integer("LVIO", "1: the last target was outside the limits"),
    _integer("HLS", "1: the limit switch at the upper end is active"),
    _integer("LLS", "1: the limit switch at the lower end is active"),
    _choice("HLSV", "severity while a limit switch is active", SEVERITIES, 1),
    # Motions
    _integer("DMOV", "1: the last motion has ended", 1),
    _integer("MOVN", "1: the axis moves"),
    _integer("TDIR", "direction of the last motion: 1 to higher dial positions", 1),
    _integer("STOP", "1 stops the axis"),
    _choice("SPMG", "Stop and Pause stop; Move allows one motion", ("Stop", "Pause", "Move", "Go"), 3),
    _choice("CNEN", "whether the motor is enabled", ("Disable", "Enable"), 1),
    _integer("HOMF", "1 homes with the settings of the controller"),
    _integer("HOMR", "1 homes with the settings of the controller"),
    _integer("JOGF", "1 moves towards the upper limit until 0"),
    _integer("JOGR", "1 moves towards the lower limit until 0"),
    _integer("TWF", "1 moves by TWV"),
    _integer("TWR", "1 moves by -TWV"),
    _position("TWV", "distance of TWF and TWR", 1.0),
    _integer("MISS", "1: the last motion did not reach its target"),
    _integer("MSTA", "status bits as in EPICS: 1 done, 2 and 13 limits, 9 fault, 10 moving, 14 homed"),
    # Velocity
    _velocity("VELO", "velocity of moves"),
    _velocity("VMAX", "highest velocity that clients may set"),
    _velocity("VBAS", "velocity at which a motion begins"),
    _velocity("JVEL", "velocity of JOGF and JOGR, the same as VELO"),
    _float("ACCL", "seconds from rest to VELO"),
    # Resolution
    _text("EGU", "unit of positions"),
    _integer("PREC", "number of decimals"),
    _float("MRES", "length of a count"),
    _float("ERES", "length of a count of the encoder, the same as MRES"),
    _integer("SREV", "counts in UREV"),
    _float("UREV", "length of SREV counts", 1.0),
    _position("RDBD", "distance within which a target counts as reached: one count"),
    # Retries and backlash, which the controllers handle themselves
    _integer("RTRY", "number of retries: none"),
    _position("BDST", "backlash distance: none"),
    # Identity
    _text("RTYP", "type of the record", "motor"),
    _text("DESC", "description of the motor"),
    _text("OUT", "controller and part"),
)  # fmt: skip
