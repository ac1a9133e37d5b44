"""User input for ``stagewire virtual``: benches, recordings to replay, faults and options.

Every public function makes one :class:`~sandbox.Case` from a ``random.Random``. Valid input is served for a
moment, on pseudo-terminals and on local ports only.
"""

from __future__ import annotations

from random import Random

from malformed_text import damaged_bytes, damaged_text, word
from sandbox import Case

MOMENT = ("--for", "0.001")
# Without symbolic links, and on free ports, so that the result does not depend on the machine.
BENCH = """\
[[unit]]
name = "TDC001"
label = "x stage"
tcp = "127.0.0.1:0"
stage = "Z8"
position = 514560
seed = 7
quirks = ["long_status"]
faults = ["to_host drop frame p=0.01 seed=3"]

[[unit]]
name = "BSC103"
pty = true
line = "rs232"
answer_unsupported = true
channel = [{stage = "APT_STEPPER"}, {travel = 1000000}]

[[unit]]
name = "RACK"
bays = ["MST601", "", "MPZ601"]
model = "MMR601"
serial_number = 12345678
hardware_type = 45
stage_id = 7

[[unit]]
name = "MS2000"
tcp = 0
strategies = {power_on_mode = "low"}
"""
RECORDINGS = (
    """\
# stagewire capture 1 protocol=thorlabs_apt unit=TDC001
# 0.676743 127.0.0.1:39134 connected
0.684332 > 43 04 01 00 50 01  # 0x01->0x50 MOT_MOVE_HOME chan_ident=1
5.809315 < 44 04 01 00 01 50  # 0x50->0x01 MOT_MOVE_HOMED chan_ident=1
6.000000 > 11 04 01 00 50 01
6.000100 < 12 04 06 00 81 50 01 00 00 00 00 00
""",
    """\
# stagewire capture 1 protocol=asi_ms2000
0.100000 > 57 20 58 0D
0.200000 < 3A 41 20 30 0D 0A
0.300000 > FF 42 18 61 03 3A
0.400000 < 00 00 00
""",
)
FAULTS = (
    "to_host drop frame every=10",
    "to_controller flip byte p=0.001 seed=3 bit=7",
    "to_host delay message=MOT_GET_VELPARAMS by=2 overtaken=yes",
    "to_host insert frame at=2 hex=640401000150",
    "to_host duplicate byte every=3 count=2",
    "to_controller flood after=1 hex=050000005001 count=3 period=0.5",
    "to_host disconnect frame message=MOT_MOVE_COMPLETED",
    "stick channel=1 after=2 for=5",
)


def _damaged(rng: Random, text: str) -> bytes:
    for _ in range(rng.choice((0, 1, 1, 1, 2, 3))):
        text = damaged_text(rng, text)
    data = text.encode("utf-8", "surrogatepass")
    return damaged_bytes(rng, data) if rng.random() < 0.1 else data


def _argument(text: str) -> str:
    """Return the text as a valid process argument, without NUL and lone surrogates."""
    return text.replace("\0", "").encode("utf-8", "replace").decode("utf-8")


def _served(*arguments: str, **files: bytes) -> Case:
    return Case(("virtual", *MOMENT, *arguments), files=files, may_listen=True)


def bench(rng: Random) -> Case:
    """A bench file with several units."""
    return _served("--bench", "bench", bench=_damaged(rng, BENCH))


def replay(rng: Random) -> Case:
    """A recorded session."""
    arguments = ["--lenient"] if rng.random() < 0.3 else []
    if rng.random() < 0.5:
        arguments.append("--pty")
    recording = _damaged(rng, rng.choice(RECORDINGS))
    return _served("--replay", "recording", *arguments, recording=recording)


def fault(rng: Random) -> Case:
    """Faults, quirks and other options of one unit."""
    arguments = []
    for text in rng.sample(FAULTS, rng.randrange(1, 3)):
        damaged = damaged_text(rng, text) if rng.random() < 0.7 else text
        arguments += ["--fault", _argument(damaged)]
    for option, right in (("--quirk", "long_status"), ("--stage", "Z8"), ("--travel", "1000")):
        if rng.random() < 0.2:
            arguments += [option, _argument(word(rng)) if rng.random() < 0.3 else right]
    return _served("TDC001", *arguments)
