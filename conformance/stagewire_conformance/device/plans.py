"""Plans: which checks a run has, what they do, which are omitted and why, and how to repeat them.

:func:`plan` makes the checks: those of all kinds of the protocol, or a selection. A :class:`Plan` adds the
controller and the permissions, and is all that :func:`.execute` needs.
"""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from types import MappingProxyType
from typing import Final

from stagewire import Stage
from stagewire_conformance.device.check import Check, Kind
from stagewire_conformance.device.checks import kinds_of
from stagewire_conformance.device.declaration import Declaration, declare
from stagewire_conformance.device.errors import DeclarationError, NothingToRunError
from stagewire_conformance.device.permissions import HAZARDS, Need, Permissions
from stagewire_conformance.device.pics_file import read_pics
from stagewire_conformance.device.targets import RACK
from stagewire_conformance.notation import as_typed
from stagewire_conformance.registry import about, known_rules

_GRAVITY: Final = (
    Need.LASER, Need.HEATER, Need.SHUTTER, Need.ZERO, Need.PIEZO, Need.INERTIAL,
    Need.EEPROM, Need.MOTION, Need.TUNING, Need.SETTINGS,
)  # fmt: skip
"""A check with several needs is listed under the first of them: a check that moves is listed as moving."""


def plan(
    declared: Declaration,
    allowed: Permissions,
    *,
    only: str | Sequence[str] = (),
    kinds: Sequence[Kind] | None = None,
) -> list[Check]:
    """Return the checks of a run, in order, including those that are not allowed and will not run.

    :param only: names of kinds, names of messages, or patterns of ids with ``*`` and ``?``; empty for all.
    :param kinds: the kinds of checks, such as your own; None for those of the suite.

    Raises :class:`.NothingToRunError` if an entry of ``only`` selects nothing. Raises :class:`ValueError` or
    :class:`TypeError` for invalid kinds: two checks with the same id, or a message or a rule that the
    registry does not have.
    """
    only = [only] if isinstance(only, str) else only
    bays = any(place.bay for place in declared.places)
    checks = [
        replace(
            check,
            kind=kind,
            rules=check.rules or about(declared.registry, kind.rules, check.messages, bays=bays),
        )
        for kind in (kinds_of(declared.protocol) if kinds is None else kinds)
        for check in kind.make(declared, allowed)
    ]
    _refuse_unknown(checks, declared)
    if not only:
        return checks
    for pattern in only:
        if not any(_chooses(pattern, check) for check in checks):
            raise NothingToRunError(_nothing(pattern, checks, declared))
    return [check for check in checks if any(_chooses(pattern, check) for pattern in only)]


def _refuse_unknown(checks: Sequence[Check], declared: Declaration) -> None:
    """Raise ValueError for an unknown message or rule, or for a duplicate id."""
    registry, seen = declared.registry, set[str]()
    rules = known_rules(registry)
    for check in checks:
        messages = [name for name in check.messages if name not in registry.messages]
        unknown = messages or [rule for rule in check.rules if rule not in rules]
        if unknown:
            what = "message" if messages else "rule"
            raise ValueError(f"check {check.id}: unknown {what} {unknown[0]!r}")
        if check.id in seen:
            raise ValueError(f"duplicate check id {check.id}: give the cases different names")
        seen.add(check.id)


def _chooses(pattern: str, check: Check) -> bool:
    assert check.kind is not None
    return (
        pattern == check.kind.name
        or pattern.upper() in check.messages
        or fnmatchcase(check.id, pattern)
    )


def _nothing(pattern: str, checks: Sequence[Check], declared: Declaration) -> str:
    names = [*dict.fromkeys(_names(checks))]
    close = difflib.get_close_matches(pattern, names, n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(close)}?" if close else "--list shows all checks"
    return f"no check of {declared.unit.name} matches {pattern or repr(pattern)}; {hint}"


def _names(checks: Sequence[Check]) -> Iterator[str]:
    for check in checks:
        kind: Kind | None = check.kind
        yield kind.name if kind else check.id
        yield from check.messages
        yield check.id


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A run that has not begun.

    :param checks: the selected checks, in order, including those that are not allowed.
    :param only: the names and patterns that selected them; empty for all.
    :param unselected: the number of checks that they did not select.
    :param seed: seeds all random choices.
    :param pics: the file that declares the controller, if any.
    """

    declared: Declaration
    allowed: Permissions
    checks: tuple[Check, ...]
    only: tuple[str, ...] = ()
    unselected: int = 0
    seed: int = 1
    pics: Path | None = None

    @classmethod
    def of(
        cls,
        unit: str | None,
        allowed: Permissions,
        *,
        pics: Path | None = None,
        only: str | Sequence[str] = (),
        seed: int = 1,
        kinds: Sequence[Kind] | None = None,
        own_stages: Mapping[str, Stage] = MappingProxyType({}),
    ) -> Plan:
        """Plan a run against a unit, or against the controller that a PICS declares.

        :param unit: the name of the unit; None if there is a PICS.
        :param only: see :func:`plan`.
        :param kinds: see :func:`plan`.
        :param own_stages: the stages of the user that the PICS may name, by name.

        Raises :class:`.DeclarationError` if there is neither a unit nor a PICS, or if they contradict each
        other; :class:`.PicsError` for an invalid PICS; :class:`.NothingToRunError` if an entry of ``only``
        selects nothing; and another :class:`~stagewire.errors.StagewireError` for an unknown unit.
        """
        if unit is None and pics is None:
            raise DeclarationError(
                "missing unit: give --unit, such as --unit TDC001, or --pics FILE; "
                "stagewire conformance pics --from URL drafts a PICS"
            )
        if pics is None and str(unit).upper() == RACK:
            raise DeclarationError(
                "a rack of modules needs a PICS that lists its bays; draft one with "
                f"stagewire conformance pics --from URL --unit {RACK} --out pics.toml, and use it with "
                "--pics pics.toml"
            )
        declared = declare(read_pics(pics, own_stages) if pics is not None else str(unit))
        checks = plan(declared, allowed, only=only, kinds=kinds)
        if pics is not None and unit is not None and unit.upper() != declared.unit.name:
            raise DeclarationError(
                f"--unit {unit} contradicts {pics}, which declares a {declared.unit.name}; omit --unit"
            )
        return cls(
            declared=declared,
            allowed=allowed,
            checks=tuple(checks),
            only=(only,) if isinstance(only, str) else tuple(only),
            unselected=len(plan(declared, allowed, kinds=kinds)) - len(checks) if only else 0,
            seed=seed,
            pics=pics,
        )

    @property
    def runnable(self) -> list[Check]:
        """The checks that will run."""
        return [check for check in self.checks if not self._reason(check)]

    @property
    def seconds(self) -> float:
        """The approximate duration of the run in seconds."""
        return sum(check.seconds for check in self.runnable)

    def effects(self) -> dict[Need, list[Check]]:
        """Return the runnable checks that need a permission, each listed under the first of its needs."""
        found: dict[Need, list[Check]] = {}
        for check in self.runnable:
            gravest = next((need for need in _GRAVITY if need in check.needs), None)
            if gravest is not None:
                found.setdefault(gravest, []).append(check)
        return {need: found[need] for need in Need if need in found}

    def refusals(self) -> dict[str, int]:
        """Return each reason why checks are refused, with the number of checks."""
        return dict(Counter(filter(None, (check.refusal(self.allowed) for check in self.checks))))

    def verify(self) -> None:
        """Raise :class:`.NothingToRunError` if every check is refused or skipped."""
        if not self.runnable:
            reasons = dict.fromkeys(map(self._reason, self.checks))
            raise NothingToRunError(
                f"nothing to run; all selected checks are omitted: {'; '.join(reasons)}"
            )

    def repeat(self, url: str, only: str = "") -> str:
        """Return the command that repeats the run, or one check of it.

        :param only: the id of a check; empty for all selected checks.
        """
        words = ["stagewire", "conformance", "device", url]
        if self.pics is not None:
            words += ["--pics", str(self.pics)]
        else:
            words += ["--unit", self.declared.unit.name]
        words += ["--allow-settings"] if self.allowed.settings else []
        words += [f"--allow-motion={self.allowed.motion}"] if self.allowed.motion else []
        words += ["--allow-tuning"] if self.allowed.tuning else []
        others = [need for need in Need if need in {Need.EEPROM, *HAZARDS} & self.allowed.granted]
        words += [f"--allow-{need}" for need in others]
        for pattern in [only] if only else self.only:
            words += ["--only", pattern]
        return as_typed([*words, "--seed", str(self.seed)])

    def _reason(self, check: Check) -> str:
        """Return why a check will not run, or an empty string."""
        return check.refusal(self.allowed) or check.skip
