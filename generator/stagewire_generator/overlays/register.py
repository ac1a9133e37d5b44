"""The entries below an overlay, which it may name, and the errors about names that are not among them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

from stagewire_generator.diagnostics import Diagnostics, Place, meant

Key: TypeAlias = tuple[str, str]  # section and name


class Home(NamedTuple):
    """The place of an entry: the kind and number of its file, and its overlay, empty for the protocol."""

    kind: str
    number: int
    overlay: str


class Gone(NamedTuple):
    """An entry that is no longer there: the overlay that withdrew or renamed it, and its new name, if any."""

    overlay: str
    new: str = ""


ONE_OF_THEM = (
    "apply only one of the two overlays (--base leaves out the default ones), or let one build on the "
    "other (`builds_on` in overlay.yaml)"
)
"""The hint about two overlays that cannot be applied together."""


@dataclass(slots=True)
class Register:
    """The entries below an overlay, as far as the overlays applied so far have left them.

    :param overlay: the overlay that names entries.
    :param applied: the overlays below it, in order.
    :param builds_on: those of them whose entries it may change.
    :param homes: where each entry is defined.
    :param members: the messages of each parameter set, by its name.
    :param gone: the entries that were withdrawn or renamed.
    :param others: entry -> an overlay that is not applied and defines it.
    """

    overlay: str
    applied: tuple[str, ...]
    builds_on: Collection[str]
    homes: dict[Key, Home]
    members: Mapping[str, tuple[str, ...]]
    gone: dict[Key, Gone]
    others: Mapping[Key, str]

    def stranger(self, key: Key) -> str:
        """Return the overlay that defines an entry which this one may not change; empty if it may."""
        owner = self.homes[key].overlay
        return "" if owner in self.builds_on else owner

    def has(
        self, key: Key, place: Place, diagnostics: Diagnostics, advice: str = "", what_for: str = ""
    ) -> bool:
        """Return whether the overlay may name an entry; report an error if it may not.

        :param advice: what else to do about an unknown name.
        :param what_for: what the overlay does with the entry.
        """
        entry = ".".join(key)
        if key in self.homes:
            stranger = self.stranger(key)
            if stranger and what_for:
                diagnostics.add(place, "SW060", *replaced(key, stranger, what_for))
            return not (stranger and what_for)
        gone, other = self.gone.get(key), self.others.get(key)
        what = f"{self._below()} does not define {entry}"
        if gone and gone.overlay == self.overlay:
            what = f"the overlay itself withdraws or renames {entry}"
            hint = "remove one of the two"
        elif gone:
            what = f"the overlay {gone.overlay} withdraws or renames {entry}"
            hint = ONE_OF_THEM
            if gone.overlay in self.builds_on:
                hint = f"write its new name, {gone.new}" if gone.new else "remove it"
        elif other:
            hint = f"the overlay {other} defines it: to change it, write `builds_on: [{other}]`"
        else:
            hint = " ".join(part for part in (self._meant(key), advice) if part)
        diagnostics.add(place, "SW061", what, hint)
        return False

    def _below(self) -> str:
        """Return the protocol and the overlays below this one, in words."""
        *names, last = self.applied or ("",)
        overlays = " and ".join(filter(None, (", ".join(names), last)))
        return f"the protocol with {overlays}" if overlays else "the protocol"

    def _meant(self, key: Key) -> str:
        """Return the hint for an unknown name; empty if nothing resembles it."""
        for name, messages in self.members.items():
            if key[1] in messages and key[0] != "parameter_sets":
                return f"{key[1]} belongs to the set {name}: name that under `parameter_sets`"
        return resembling(key, self.homes)


def resembling(key: Key, known: Collection[Key]) -> str:
    """Return a hint about the entry that was probably meant: its section, or similar names in it."""
    section, name = key
    for other, same in known:
        if same == name:
            return f"{name} is an entry of `{other}`: name it there"
    return meant(name, [n for s, n in known if s == section])


def replaced(key: Key, by: str, what_for: str) -> tuple[str, str]:
    """Return the error and the hint about an entry that another overlay replaces.

    :param what_for: what the overlay with the error does with the entry.
    """
    what = f"{'.'.join(key)}: the overlay {by} replaces the entry that this would {what_for}"
    return what, ONE_OF_THEM


def owner(overlay: str) -> str:
    """Return what defines an entry, in words: an overlay, or the protocol for an empty name."""
    return f"the overlay {overlay}" if overlay else "the protocol"
