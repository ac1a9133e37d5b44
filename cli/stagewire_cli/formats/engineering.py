"""Engineering units of the fields of decoded messages, for ``decode --unit --stage``."""

from __future__ import annotations

from contextlib import suppress

from stagewire.devices import scales_on
from stagewire.discovery import device_class, model_option
from stagewire.errors import UnknownScaleError
from stagewire.protocols import Message
from stagewire_cli.devices import called_wrongly
from stagewire_conformance.registry import registry_of


class EngineeringUnits:
    """The values of messages in the units of a stage on a controller.

    :param unit: name of the unit, in any case.
    :param stage: name of the stage, or ``FILE.toml:NAME``; None: the one that is built into the unit.
    :param scale_source: source of scales on which sources disagree.

    Raises :class:`~stagewire_cli.errors.CalledWronglyError` for an unknown unit or stage.
    """

    def __init__(self, unit: str, stage: str | None, scale_source: str | None) -> None:
        with called_wrongly():
            device = device_class(unit)
            model = model_option(unit).get("model")
            self._scales = scales_on(device, stage, scale_source=scale_source, model=model)
        self._registry = registry_of(device.facts.protocol)

    def of(self, message: Message) -> dict[str, tuple[float, str]]:
        """Return the value and the unit of each field whose scale is known."""
        layout = message.layout
        found = {}
        for name, field in self._registry.fields(layout.message, layout.form).items():
            quantity = field.get("quantity")
            if quantity and isinstance(raw := getattr(message, name), int):
                with suppress(UnknownScaleError):
                    scale = self._scales.of(quantity, self._scales.unit_of(quantity))
                    found[name] = float(scale.from_counts(raw)), scale.unit
        return found
