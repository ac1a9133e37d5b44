"""Rules that the resolved registry must keep; each rule is a function of one module here."""

from stagewire_generator.lint.devices import check_devices
from stagewire_generator.lint.effects import check_effects
from stagewire_generator.lint.errata import check_errata
from stagewire_generator.lint.framing import check_framing
from stagewire_generator.lint.layouts import check_layouts
from stagewire_generator.lint.names import check_names
from stagewire_generator.lint.pages import check_pages

__all__ = [
    "check_devices",
    "check_effects",
    "check_errata",
    "check_framing",
    "check_layouts",
    "check_names",
    "check_pages",
]
