"""Files that vendors write: the PICS of a controller, and the expected failures of a codec.

Every public function makes one :class:`~sandbox.Case` from a ``random.Random``. The command only validates
the file; it sends nothing to a controller or codec.
"""

from __future__ import annotations

from random import Random

from malformed_text import damaged_bytes, damaged_text
from sandbox import Case

PICS = (
    """\
schema_version = 1
protocol = "thorlabs_apt"
unit = "TDC001"
line = "usb"

[unsupported]
MOT_REQ_POTPARAMS = "no potentiometer fitted"

[[channel]]
number = 1
stage = "Z8"
travel = "0..12mm"
homes = true
limit_switches = true

[timing]
reply_p99_ms = 50
""",
    """\
schema_version = 1
protocol = "thorlabs_apt"
unit = "RACK"

[[bay]]
number = 1
unit = "MST601"
""",
    """\
schema_version = 1
protocol = "asi_ms2000"
unit = "MS2000"

[[channel]]
axis = "X"
travel = "0..100mm"
""",
)
EXPECTED = """\
schema_version = 1

[[expected]]
id = "thorlabs_apt/HW_RICHRESPONSE/*/encode/*"
reason = "a host does not send it"

[[expected]]
id = "lines/nan"
reason = "the platform's reader of JSON takes NaN"
"""


def _damaged(rng: Random, text: str) -> bytes:
    for _ in range(rng.choice((0, 1, 1, 1, 2, 3))):
        text = damaged_text(rng, text)
    data = text.encode("utf-8", "surrogatepass")
    return damaged_bytes(rng, data) if rng.random() < 0.1 else data


def pics(rng: Random) -> Case:
    """The PICS of a controller."""
    arguments = ("conformance", "device", "--pics", "pics.toml", "--list")
    return Case(arguments, files={"pics.toml": _damaged(rng, rng.choice(PICS))})


def expected(rng: Random) -> Case:
    """The expected failures of a codec."""
    arguments = ("conformance", "codec", "--expected", "expected.toml", "--list", "--only", "order")
    return Case(arguments, files={"expected.toml": _damaged(rng, EXPECTED)})
