"""Plans: which checks a run has, what they will do, which are left out and why, and how to repeat them.

:func:`plan` makes the checks: all of the protocol's kinds, or those that were asked for. A :class:`Plan`
has the controller and the permissions as well, and is all that :func:`.execute` needs.
"""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Final

from stagewire_conformance.device.check import Check, Kind
from stagewire_conformance.device.checks import kinds_of
from stagewire_conformance.device.declaration import Declaration, declare
from stagewire_conformance.device.errors import DeclarationError, NothingToRunError
from stagewire_conformance.device.permissions import Need, Permissions
from stagewire_conformance.device.pics_file import read_pics
from stagewire_conformance.device.targets import RACK
from stagewire_conformance.notation import as_typed
from stagewire_conformance.registry import about, known_rules

_GRAVITY: Final = (Need.EEPROM, Need.MOTION, Need.SETTINGS)
"""A check with several needs counts under the first of them: a check that moves is listed as moving."""


def plan(
    declared: Declaration,
    allowed: Permissions,
    *,
    only: str | Sequence[str] = (),
    kinds: Sequence[Kind] | None = None,
) -> list[Check]:
    """Return the checks of a run, in order; what is not allowed is among them, and not run.

    :param only: names of kinds, names of messages, or patterns of ids with ``*`` and ``?``; empty: all.
    :param kinds: the kinds of checks, such as some of your own; None: those of the suite.

    Raises :class:`.NothingToRunError` for one of ``only`` that chooses nothing; :class:`ValueError` and
    :class:`TypeError` for kinds that cannot be run: an id that two checks have, or a message or a rule that
    the registry does not have.
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
    """Raise ValueError for what a kind declares and no run could use."""
    registry, seen = declared.registry, set[str]()
    rules = known_rules(registry)
    for check in checks:
        messages = [name for name in check.messages if name not in registry.messages]
        unknown = messages or [rule for rule in check.rules if rule not in rules]
        if unknown:
            what = "message" if messages else "rule"
            raise ValueError(f"the check {check.id}: the registry has no {what} {unknown[0]!r}")
        if check.id in seen:
            raise ValueError(f"two checks have the id {check.id}; give their cases different names")
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
    hint = f"did you mean {' or '.join(close)}?" if close else "--list shows what there is"
    return f"no check of {declared.unit.name} is named {pattern or repr(pattern)}; {hint}"


def _names(checks: Sequence[Check]) -> Iterator[str]:
    for check in checks:
        kind: Kind | None = check.kind
        yield kind.name if kind else check.id
        yield from check.messages
        yield check.id


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A run against a controller that has not begun.

    :param checks: those that were chosen, in order; checks that are not allowed are among them.
    :param only: the names and patterns that chose them; empty: all.
    :param seed: decides all that is left to chance.
    :param pics: the file that declares the controller, if there is one.
    """

    declared: Declaration
    allowed: Permissions
    checks: tuple[Check, ...]
    only: tuple[str, ...] = ()
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
    ) -> Plan:
        """Plan a run against a unit, or against the controller that a PICS declares.

        :param unit: its name; None where there is a PICS.
        :param only: see :func:`plan`.
        :param kinds: see :func:`plan`.

        Raises :class:`.DeclarationError` where neither declares the controller or both contradict each
        other, :class:`.PicsError` for a file that cannot be used, :class:`.NothingToRunError` where one of
        ``only`` chooses nothing, and another :class:`~stagewire.errors.StagewireError` for an unknown unit.
        """
        if unit is None and pics is None:
            raise DeclarationError(
                "what is there? give --unit, such as --unit TDC001, or --pics; "
                "stagewire conformance pics --from URL writes one"
            )
        if pics is None and str(unit).upper() == RACK:
            raise DeclarationError(
                "what is in the bays of a rack only a PICS says: stagewire conformance pics --from URL "
                f"--unit {RACK} --out pics.toml writes one, and --pics pics.toml uses it"
            )
        declared = declare(read_pics(pics) if pics is not None else str(unit))
        checks = plan(declared, allowed, only=only, kinds=kinds)
        if pics is not None and unit is not None and unit.upper() != declared.unit.name:
            raise DeclarationError(
                f"--unit {unit} contradicts {pics}, which is one of {declared.unit.name}; leave --unit away"
            )
        return cls(
            declared=declared,
            allowed=allowed,
            checks=tuple(checks),
            only=(only,) if isinstance(only, str) else tuple(only),
            seed=seed,
            pics=pics,
        )

    @property
    def runnable(self) -> list[Check]:
        """The checks that will be run."""
        return [check for check in self.checks if not self._reason(check)]

    @property
    def seconds(self) -> float:
        """About how long the run takes."""
        return sum(check.seconds for check in self.runnable)

    def effects(self) -> dict[Need, list[Check]]:
        """Return the checks that will do more than ask, each under the gravest of its needs."""
        found: dict[Need, list[Check]] = {}
        for check in self.runnable:
            gravest = next((need for need in _GRAVITY if need in check.needs), None)
            if gravest is not None:
                found.setdefault(gravest, []).append(check)
        return {need: found[need] for need in Need if need in found}

    def refusals(self) -> dict[str, int]:
        """Return the reasons for which checks are refused, each with the number of its checks."""
        return dict(Counter(filter(None, (check.refusal(self.allowed) for check in self.checks))))

    def verify(self) -> None:
        """Raise :class:`.NothingToRunError` where every check is refused or skipped."""
        if not self.runnable:
            reasons = dict.fromkeys(map(self._reason, self.checks))
            raise NothingToRunError(
                f"there is nothing to run; all that was chosen is left out: {'; '.join(reasons)}"
            )

    def repeat(self, url: str, only: str = "") -> str:
        """Return the command that repeats the run, or one check of it.

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

    def _reason(self, check: Check) -> str:
        """Return why a check will not be run; empty if it will."""
        return check.refusal(self.allowed) or check.skip
