"""Controller discovery: which ports exist, which controllers are connected, and why one is not found.

:func:`discover` lists the serial ports that the operating system reports; it opens none of them unless called
    with ``ask=True``. :func:`open` opens a controller without the name of its class.
    :func:`diagnose_computer` and :func:`diagnose_line` return what is wrong and how to fix it.

Names of units, prefixes of serial numbers and addresses come from the registries of the installed protocols.
"""

from __future__ import annotations

from stagewire._lazy import lazy

TYPE_CHECKING: bool = False
if TYPE_CHECKING:
    from stagewire._discovery.diagnosis import Diagnosis, Verdict, diagnose_computer, diagnose_line
    from stagewire._discovery.opening import device_class, model_option, open, unit_at
    from stagewire._discovery.ports import Port
    from stagewire._discovery.products import Known, by_name, by_serial_number
    from stagewire._discovery.search import Found, discover

__all__ = [
    "Diagnosis",
    "Found",
    "Known",
    "Port",
    "Verdict",
    "by_name",
    "by_serial_number",
    "device_class",
    "diagnose_computer",
    "diagnose_line",
    "discover",
    "model_option",
    "open",
    "unit_at",
]

__path__: list[str] = []  # 0.1 had modules below this name; see stagewire._deprecated

if not TYPE_CHECKING:  # otherwise type checkers would accept any name
    __getattr__, __dir__ = lazy(
        __name__,
        {
            "_discovery.ports": "Port",
            "_discovery.products": "Known by_name by_serial_number",
            "_discovery.search": "Found discover",
            "_discovery.opening": "device_class model_option open unit_at",
            "_discovery.diagnosis": "Diagnosis Verdict diagnose_computer diagnose_line",
        },
    )
