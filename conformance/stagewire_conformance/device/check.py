"""Checks, their kinds, and the decorator that declares a check."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Final, TypeVar

from stagewire_conformance.device.permissions import HAZARDS, Need

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


_OPTIONS: Final[dict[Need, str]] = {
    Need.SETTINGS: "--allow-settings",
    Need.TUNING: "--allow-tuning",
    Need.MOTION: "--allow-motion MIN..MAX",
    Need.EEPROM: "--allow-eeprom",
    **{hazard: f"--allow-{hazard}" for hazard in HAZARDS},
}

_ALLOWED: Final = "the allowed range"
"""Replaces ``{range}`` in descriptions if no range was given."""


@dataclass(frozen=True, kw_only=True)
class Check:
    """One requirement on a controller, and the function that tests it.

    :param id: ``KIND[/PLACE][/MESSAGE][/…]``, such as ``answers/0x50/MOT_REQ_VELPARAMS/1``. It is unique in a
        run and the same in every run.
    :param title: a sentence that states what the controller has to do.
    :param messages: the messages that the check covers.
    :param run: tests the controller and reports its findings to the trial.
    :param needs: the permissions that the check needs.
    :param does: for a check with needs, a plain description of what it does. It is shown before the run.
    :param bound: for a check that moves something, the bound of each motion in time and distance. It is shown
        before the run.
    :param seconds: the approximate duration.
    :param rules: the rules that the check tests. If empty, :func:`.plan` takes the rules of its kind that
        concern its messages, or no particular message.
    :param skip: why the PICS skips the check; empty if it does not.
    :param lacks: why the check cannot run with what was allowed; empty if it can.
    :param kind: set by :func:`.plan`.
    """

    id: str
    title: str
    messages: tuple[str, ...]
    run: Callable[[Trial], None]
    needs: frozenset[Need] = frozenset()
    does: str = ""
    bound: str = ""
    seconds: float = 0.08
    rules: tuple[str, ...] = ()
    skip: str = ""
    lacks: str = ""
    kind: Kind | None = field(default=None, repr=False, compare=False)

    def refusal(self, allowed: Permissions) -> str:
        """Return why the check does not run with these permissions, or an empty string."""
        missing = [need for need in Need if need in self.needs - allowed.granted]
        if missing:
            return f"not allowed: needs {' and '.join(_OPTIONS[need] for need in missing)}"
        return self.lacks


_F = TypeVar("_F", bound=Callable[..., None])


@dataclass(frozen=True, kw_only=True)
class Case:
    """One of several checks that are declared together.

    :param name: follows the name of the kind in the id.
    :param arguments: keyword arguments of the decorated function. ``title`` and ``does`` may use them in
        braces, as in ``{place.name}``; ``{range}`` is the allowed range.
    :param words: additional names for these texts.
    :param messages: additional messages.
    :param needs: additional needs.
    :param rules: replaces the rules of the declaration.
    :param seconds: replaces the duration of the declaration.
    :param skip: see :class:`Check`.
    :param lacks: see :class:`Check`.
    """

    name: str = ""
    arguments: Mapping[str, object] = field(default_factory=dict)
    words: Mapping[str, object] = field(default_factory=dict)
    messages: Iterable[str] = ()
    needs: frozenset[Need] = frozenset()
    rules: tuple[str, ...] | None = None
    seconds: float | None = None
    skip: str = ""
    lacks: str = ""


def once(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    """Yield a single case, for a check of the whole controller."""
    yield Case()


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A family of checks: one row in the table of checks.

    :param name: such as ``answers``; the ids of its checks begin with it.
    :param title: one sentence that is true of a controller that passes.
    :param rules: the slugs of the rules that its checks test.
    :param robustness: whether its checks send damaged input that the document says nothing about. Their
        findings are FRAGILE, and are not part of the verdict.

    Decorate functions with :meth:`check` to add checks.

    Raises :class:`TypeError` if ``rules`` is a string.
    """

    name: str
    title: str
    rules: tuple[str, ...] = ()
    robustness: bool = False
    _makers: list[Callable[[Declaration, Permissions], Iterable[Check]]] = field(
        default_factory=list, init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        """Refuse a string in place of a tuple."""
        self._refuse_text(rules=self.rules)

    def check(
        self,
        title: str,
        *,
        messages: tuple[str, ...] = (),
        needs: Iterable[Need] = (),
        does: str = "",
        bound: str = "",
        seconds: float = 0.08,
        rules: tuple[str, ...] = (),
        name: str = "",
        each: Callable[[Declaration, Permissions], Iterable[Case]] = once,
    ) -> Callable[[_F], _F]:
        """Declare a function as a check; a decorator.

        The function is called with the trial, and with the arguments of its case as keyword arguments.

        :param each: yields the cases for a declared controller, in the order in which they run.
        :param name: follows the name of the case in the id.

        For other parameters see :class:`Check`. Raises :class:`TypeError`, naming the kind, for an invalid
        declaration. Errors in its cases are raised when a run is planned.
        """
        if callable(title):
            raise TypeError(f"{self._what}: missing title, as in @KIND.check('It answers')")
        self._refuse_text(messages=messages, rules=rules, needs=needs)
        needed = self._needs(needs)

        def checks(run: _F, declared: Declaration, allowed: Permissions) -> Iterator[Check]:
            for case in each(declared, allowed):
                self._refuse_case(run, case)
                words = {"range": allowed.motion or _ALLOWED, **case.arguments, **case.words}
                yield Check(
                    id="/".join(filter(None, (self.name, case.name, name))),
                    title=self._filled(title, words),
                    messages=tuple(dict.fromkeys((*messages, *case.messages))),
                    run=partial(run, **case.arguments),
                    needs=needed | case.needs,
                    does=self._filled(does, words),
                    bound=self._filled(bound, words),
                    seconds=seconds if case.seconds is None else case.seconds,
                    rules=rules if case.rules is None else case.rules,
                    skip=case.skip,
                    lacks=case.lacks,
                )

        def declare(run: _F) -> _F:
            if inspect.iscoroutinefunction(run) or inspect.isgeneratorfunction(run):
                raise TypeError(
                    f"{self._what}: {run.__qualname__} must be a plain function, without async or yield"
                )
            self._makers.append(partial(checks, run))
            return run

        return declare

    @property
    def _what(self) -> str:
        return f"a check of the kind {self.name}"

    def _refuse_text(self, **given: object) -> None:
        for name, value in given.items():
            if isinstance(value, str):
                raise TypeError(
                    f"{self._what}: {name} must be a tuple, such as ({value!r},), not a string"
                )

    def _needs(self, needs: Iterable[Need]) -> frozenset[Need]:
        known = frozenset(needs)
        if unknown := [need for need in known if not isinstance(need, Need)]:
            names = ", ".join(f"Need.{need.name}" for need in Need)
            raise TypeError(f"{self._what}: unknown need {unknown[0]!r} (choose from {names})")
        return known

    def _refuse_case(self, run: Callable[..., None], case: object) -> None:
        """Refuse a case that a run could not use."""
        if not isinstance(case, Case):
            raise TypeError(f"{self._what}: each yields {case!r}, which is not a Case")
        self._refuse_text(messages=case.messages, rules=case.rules, needs=case.needs)
        self._needs(case.needs)
        try:
            inspect.signature(run).bind(None, **case.arguments)
        except TypeError as error:
            raise TypeError(
                f"{self._what}: {run.__qualname__} is called with the trial and the arguments of its case "
                f"({', '.join(case.arguments) or 'none'}): {error}"
            ) from None

    def _filled(self, text: str, words: Mapping[str, object]) -> str:
        try:
            return text.format(**words)
        except (LookupError, AttributeError, ValueError) as error:
            raise ValueError(
                f"{self._what}: cannot fill in {text!r} from its case, which has "
                f"{', '.join(words)}: {error}"
            ) from None

    def make(self, declared: Declaration, allowed: Permissions) -> Iterator[Check]:
        """Yield the checks of a controller, in the order in which their functions are declared."""
        for make in self._makers:
            yield from make(declared, allowed)
