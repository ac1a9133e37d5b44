"""Controller discovery: which ports exist, which controllers are connected, and why one is not found.

:func:`discover` reads what the operating system reports of its serial ports and opens none of them, unless
it is asked to. :func:`open` opens a controller without the name of its class. :func:`diagnose_computer` and
:func:`diagnose_line` return what is wrong, and what to do about it.

The runtime knows no unit: names, prefixes of serial numbers and addresses come from the registries of the
installed protocols.
"""

from __future__ import annotations

from stagewire._lazy import lazy

TYPE_CHECKING = False
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

__path__: list[str] = []  # modules of 0.1 below this name; see stagewire._deprecated

if not TYPE_CHECKING:  # else any name would be taken for one of these
    __getattr__ = lazy(
        __name__,
        {
            "_discovery.ports": "Port",
            "_discovery.products": "Known by_name by_serial_number",
            "_discovery.search": "Found discover",
            "_discovery.opening": "device_class model_option open unit_at",
            "_discovery.diagnosis": "Diagnosis Verdict diagnose_computer diagnose_line",
        },
    )
