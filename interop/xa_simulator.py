"""Start the bridge to a simulated controller of the vendor's XA SDK, and end it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

BRIDGE = Path(__file__).with_name("xa_bridge.py")

KDC101 = {"PartNumber": "KDC101", "SerialNumber": "27000001", "ActuatorType": "MTS25-Z8"}
KST201 = {"PartNumber": "KST201", "SerialNumber": "26000001", "ActuatorType": "ZST213"}
LTS300C = {"PartNumber": "LTS300C", "SerialNumber": "45000001"}
KSC101 = {"PartNumber": "KSC101", "SerialNumber": "68000001", "ActuatorType": "SH05"}
KIM101 = {"PartNumber": "KIM101", "SerialNumber": "97000001"}
KIM001 = {"PartNumber": "KIM001", "SerialNumber": "74000001"}
PDXC2 = {"PartNumber": "PDXC2", "SerialNumber": "112000001", "ActuatorType": "PDX1"}
BPC301 = {"PartNumber": "BPC301", "SerialNumber": "41000001"}
KPC101 = {"PartNumber": "KPC101", "SerialNumber": "113000001"}
KNA101 = {"PartNumber": "KNA101", "SerialNumber": "57000001"}
BBD303 = {
    "PartNumber": "BBD303",
    "SerialNumber": "103003334",
    "Channels": [
        {"BayNumber": "1", "SerialNumber": "104003335", "ActuatorType": "DDS600"},
        {"BayNumber": "2", "SerialNumber": "104003336", "ActuatorType": "DDS300"},
        {"BayNumber": "3", "SerialNumber": "104003337", "ActuatorType": "DDS600"},
    ],
}


class NotStartedError(Exception):
    """The SDK did not start the simulation."""


@contextmanager
def simulated(description: Mapping[str, Any]) -> Iterator[str]:
    """Simulate a controller until the block ends, and yield its URL.

    :param description: the description of the SDK: part number, serial number, and actuator or channels.
    :raises NotStartedError: the SDK did not start it; the text is its error.
    """
    with tempfile.TemporaryDirectory() as home:
        errors = Path(home, "errors.txt")
        with errors.open("w", encoding="utf-8") as file:
            bridge = subprocess.Popen(
                [sys.executable, str(BRIDGE), json.dumps(description)],
                env={**os.environ, "HOME": home},
                stdout=subprocess.PIPE,
                stderr=file,
                text=True,
            )
        try:
            assert bridge.stdout is not None
            url = bridge.stdout.readline().strip()
            if not url:
                lines = errors.read_text(encoding="utf-8").splitlines()
                raise NotStartedError(lines[-1] if lines else "the bridge ended")
            yield url
        finally:
            bridge.kill()
            bridge.wait()
