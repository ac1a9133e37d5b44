"""What a run against a controller is going to be: who is declared, what is allowed, which checks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from stagewire.errors import StagewireError
from stagewire_cli.conformance.typed import as_typed
from stagewire_cli.errors import CalledWronglyError
from stagewire_conformance.device.check import Check
from stagewire_conformance.device.declared import RACK, Declared, declare
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.pics_file import read_pics
from stagewire_conformance.device.planning import plan
from stagewire_conformance.device.ranges import Range

__all__ = ["Planned", "planned"]


@dataclass(frozen=True)
class Planned:
    """A run that has not begun.

    :param pics: the file that declares the controller, if there is one.
    :param only: what was asked for of all checks.
    :param checks: those that were chosen, in order; what is not allowed is among them.
    """

    declared: Declared
    pics: Path | None
    allowed: Permissions
    only: tuple[str, ...]
    seed: int
    checks: tuple[Check, ...]

    @property
    def runnable(self) -> list[Check]:
        """The checks that will be run."""
        return [check for check in self.checks if not self.refusal(check) and not check.skip]

    def refusal(self, check: Check) -> str:
        """Return why a check will not be run; empty if it will."""
        return check.refusal(self.allowed)

    def again(self, url: str, only: str) -> str:
        """Return the command that does the same again, or of it one check alone.

        :param only: the id of a check; empty for all that were chosen.
        """
        words = ["stagewire", "conformance", "device", url]
        if self.pics is not None:
            words += ["--pics", str(self.pics)]
        else:
            words += ["--unit", self.declared.unit.name]
        words += ["--allow-settings"] if self.allowed.settings else []
        words += [f"--allow-motion={self.allowed.motion}"] if self.allowed.motion else []
        words += ["--allow-eeprom"] if self.allowed.eeprom else []
        for pattern in [only] if only else self.only:
            words += ["--only", pattern]
        return as_typed([*words, "--seed", str(self.seed)])


def planned(
    unit: str | None,
    pics: Path | None,
    *,
    settings: bool,
    motion: str | None,
    eeprom: bool,
    only: tuple[str, ...],
    seed: int,
) -> Planned:
    """Return the run that the options ask for.

    Raises :class:`CalledWronglyError` for a unit that there is not, a PICS that is wrong, a range that is
    none, and where nothing is chosen.
    """
    if unit is None and pics is None:
        raise CalledWronglyError(
            "what is there? give --unit, such as --unit TDC001, or --pics; "
            "stagewire conformance pics --from URL writes one"
        )
    if pics is None and str(unit).upper() == RACK:
        raise CalledWronglyError(
            "what is in the bays of a rack only a PICS says: stagewire conformance pics --from URL "
            f"--unit {RACK} --out pics.toml writes one, and --pics pics.toml uses it"
        )
    try:
        declared = declare(read_pics(pics) if pics is not None else str(unit))
        allowed = Permissions(
            settings=settings, motion=_range(motion) if motion else None, eeprom=eeprom
        )
        checks = plan(declared, allowed, only=only)
    except StagewireError as error:
        raise CalledWronglyError(str(error)) from None
    if pics is not None and unit is not None and unit.upper() != declared.unit.name:
        raise CalledWronglyError(
            f"--unit {unit} contradicts {pics}, which is one of {declared.unit.name}; leave --unit away"
        )
    return Planned(declared, pics, allowed, only, seed, tuple(checks))


def _range(text: str) -> Range:
    try:
        return Range.parse(text)
    except StagewireError as error:
        raise CalledWronglyError(f"--allow-motion: {error}") from None
