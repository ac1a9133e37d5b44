"""A check, the kind that it belongs to, and the decorator that declares one."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Final, TypeVar

from stagewire_conformance.device.permissions import Need

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


_OPTIONS: Final[dict[Need, str]] = {
    Need.SETTINGS: "--allow-settings",
    Need.MOTION: "--allow-motion MIN..MAX",
    Need.EEPROM: "--allow-eeprom",
}

_ALLOWED: Final = "the range that is allowed"
"""Stands for the range in descriptions where none was given."""


@dataclass(frozen=True, kw_only=True)
class Check:
    """One thing that a controller has to do, and how it is seen.

    :param id: ``KIND[/PLACE][/MESSAGE][/…]``, such as ``answers/0x50/MOT_REQ_VELPARAMS/1``; the same in every
        run, and unique in it.
    :param title: what the controller has to do, in one sentence.
    :param messages: the messages that it covers.
    :param run: looks at it, and says to the trial what it finds.
    :param needs: what has to be allowed.
    :param does: for a check with needs, what it will do, in plain words; shown before the run.
    :param seconds: about how long it takes.
    :param rules: the rules that it is about; if none are given, :func:`.plan` takes those of its kind that
        concern its messages, or no message in particular.
    :param skip: why it is skipped, which only the PICS can say; empty: it is not.
    :param lacks: why what was allowed is not enough, so that it is not run; empty: it is.
    :param kind: set by :func:`.plan`.
    """

    id: str
    title: str
    messages: tuple[str, ...]
    run: Callable[[Trial], None]
    needs: frozenset[Need] = frozenset()
    does: str = ""
    seconds: float = 0.1
    rules: tuple[str, ...] = ()
    skip: str = ""
    lacks: str = ""
    kind: Kind | None = field(default=None, repr=False, compare=False)

    def refusal(self, allowed: Permissions) -> str:
        """Return why it is not run with what is allowed; empty if it is."""
        missing = [need for need in Need if need in self.needs - allowed.granted]
        if missing:
            return f"not allowed: needs {' and '.join(_OPTIONS[need] for need in missing)}"
        return self.lacks


_F = TypeVar("_F", bound=Callable[..., None])


@dataclass(frozen=True, kw_only=True)
class Case:
    """One check of several that are declared together: where it looks, and how it differs from the others.

    :param name: follows the name of the kind in its id.
    :param arguments: of the function that is declared, by keyword. The title and what will be done name them
        in braces: ``{place.name}``, and ``{range}`` for the range that was allowed.
    :param words: more names for these texts.
    :param messages: that it covers besides those of the declaration.
    :param needs: besides those of the declaration.
    :param rules: in place of those of the declaration.
    :param seconds: in place of those of the declaration.
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
    """Give the one case of a check of the whole controller."""
    yield Case()


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A family of checks: one row of the table of what the suite looks at.

    :param name: such as ``answers``; the ids of its checks begin with it.
    :param title: one sentence that holds for a controller that passes.
    :param rules: the rules of the protocol that it holds a controller to, by their slugs.

    Its checks are functions that :meth:`check` decorates.

    Raises :class:`TypeError` for rules that are a text.
    """

    name: str
    title: str
    rules: tuple[str, ...] = ()
    _makers: list[Callable[[Declaration, Permissions], Iterable[Check]]] = field(
        default_factory=list, init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        """Refuse what no run could use."""
        self._refuse_text(rules=self.rules)

    def check(
        self,
        title: str,
        *,
        messages: tuple[str, ...] = (),
        needs: Iterable[Need] = (),
        does: str = "",
        seconds: float = 0.1,
        rules: tuple[str, ...] = (),
        name: str = "",
        each: Callable[[Declaration, Permissions], Iterable[Case]] = once,
    ) -> Callable[[_F], _F]:
        """Declare a function that looks at one thing as a check; a decorator.

        The function gets the trial, and the arguments of its case by keyword.

        :param each: gives the cases of a controller that is declared, in the order in which they run.
        :param name: follows the name of the case in the id.

        All others: see :class:`Check`. Raises :class:`TypeError`, which names the kind, for what cannot be
        a check; what its cases get wrong is raised when a run is planned.
        """
        if callable(title):
            raise TypeError(f"{self._what}: write a title, as in @KIND.check('It answers')")
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
                    seconds=seconds if case.seconds is None else case.seconds,
                    rules=rules if case.rules is None else case.rules,
                    skip=case.skip,
                    lacks=case.lacks,
                )

        def declare(run: _F) -> _F:
            if inspect.iscoroutinefunction(run) or inspect.isgeneratorfunction(run):
                raise TypeError(
                    f"{self._what}: {run.__qualname__} is a plain function, without async and yield"
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
                    f"{self._what}: {name} is a tuple, such as ({value!r},), not a text"
                )

    def _needs(self, needs: Iterable[Need]) -> frozenset[Need]:
        known = frozenset(needs)
        if unknown := [need for need in known if not isinstance(need, Need)]:
            names = ", ".join(f"Need.{need.name}" for need in Need)
            raise TypeError(f"{self._what}: needs has {unknown[0]!r}, and takes {names}")
        return known

    def _refuse_case(self, run: Callable[..., None], case: object) -> None:
        """Refuse what ``each`` gives and a run could not use."""
        if not isinstance(case, Case):
            raise TypeError(f"{self._what}: each gives {case!r}, which is not a Case")
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
                f"{self._what}: {text!r} cannot be filled in from its case, which has "
                f"{', '.join(words)}: {error}"
            ) from None

    def make(self, declared: Declaration, allowed: Permissions) -> Iterator[Check]:
        """Give its checks of a controller, in the order in which their functions are declared."""
        for make in self._makers:
            yield from make(declared, allowed)
