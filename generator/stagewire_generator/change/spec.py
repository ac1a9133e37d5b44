"""A checked spec as one side of a comparison: its protocols, and each of them under each of its overlays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from stagewire_generator.checks import Checked
from stagewire_generator.model import Protocol
from stagewire_generator.reader import Files

__all__ = ["Spec"]


@dataclass(frozen=True, slots=True)
class Spec:
    """What ``check`` makes of a spec. A title is ``PROTOCOL``, or ``PROTOCOL/OVERLAY``.

    :param protocols: without overlays.
    :param files: title -> the files of a protocol, or those that an overlay has of its own.
    :param overlays: title -> the protocol under this overlay alone.
    """

    protocols: Sequence[Protocol]
    files: Mapping[str, Files] = field(default_factory=dict)
    overlays: Mapping[str, Protocol] = field(default_factory=dict)

    @classmethod
    def of(cls, checked: Mapping[str, Checked]) -> Spec:
        """Return the side that was checked, by titles."""
        models = {title: one.protocol for title, one in checked.items()}
        return cls(
            protocols=[model for title, model in models.items() if "/" not in title],
            files={title: one.files for title, one in checked.items()},
            overlays={title: model for title, model in models.items() if "/" in title},
        )

    def model(self, title: str) -> Protocol:
        """Return the model of a title."""
        found = self.overlays.get(title)
        return found or next(p for p in self.protocols if p.name == title)

    def overlays_of(self, protocol: str) -> list[str]:
        """Return the names of the overlays of a protocol, sorted."""
        titles = (title.split("/") for title in sorted(self.overlays))
        return [overlay for name, overlay in titles if name == protocol]
