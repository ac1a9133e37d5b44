"""The entries of a protocol that an overlay may name, and the errors about names that are not among them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from stagewire_generator.diagnostics import Diagnostics, Place, meant

Key: TypeAlias = tuple[str, str]  # section and name
Home: TypeAlias = tuple[str, int]  # kind of file, and the number of the file

ONE_OF_THEM = (
    "apply only one of the two overlays (--base leaves out the default ones), or write one that "
    "combines them"
)
"""The hint about two overlays that cannot be applied together."""


@dataclass(slots=True)
class Register:
    """The entries of a protocol, as far as the overlays applied so far have left them.

    :param overlay: the overlay that names entries.
    :param homes: where each entry is defined.
    :param members: the messages of each parameter set, by its name.
    :param gone: entry -> the overlay that withdrew or renamed it.
    :param others: entry -> an overlay that is not applied and defines it.
    """

    overlay: str
    homes: dict[Key, Home]
    members: Mapping[str, tuple[str, ...]]
    gone: dict[Key, str]
    others: Mapping[Key, str]

    def has(self, key: Key, place: Place, diagnostics: Diagnostics, advice: str = "") -> bool:
        """Return whether the protocol has an entry; report an error if it does not.

        :param advice: what else to do.
        """
        if key in self.homes:
            return True
        entry, by, other = ".".join(key), self.gone.get(key), self.others.get(key)
        what = f"the protocol does not define {entry}"
        if by == self.overlay:
            what = f"the overlay itself withdraws or renames {entry}"
            hint = "remove one of the two"
        elif by:
            what = f"the overlay {by} withdraws or renames {entry}"
            hint = ONE_OF_THEM
        elif other:
            hint = f"the overlay {other} defines it, and no overlay can change another: make the change there"
        else:
            hint = " ".join(part for part in (self._meant(key), advice) if part)
        diagnostics.add(place, "SW061", what, hint)
        return False

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
