"""All defects of firmware."""

from __future__ import annotations

from faulty_commands import COMMANDS
from faulty_dynamics import DYNAMICS
from faulty_identity import IDENTITY
from faulty_inertial import INERTIAL
from faulty_light import LIGHT
from faulty_moves import MOVES
from faulty_outputs import OUTPUTS
from faulty_piezos import PIEZOS
from faulty_reception import RECEPTION
from faulty_replies import REPLIES
from faulty_settings import SETTINGS
from faulty_status import STATUS
from faulty_storage import STORAGE
from faulty_trackers import TRACKERS
from faulty_updates import UPDATES

__all__ = ["COMMANDS", "DEFECTS"]

DEFECTS = (
    *REPLIES, *SETTINGS, *STORAGE, *STATUS, *UPDATES, *IDENTITY, *RECEPTION, *MOVES, *DYNAMICS, *OUTPUTS,
    *PIEZOS, *LIGHT, *INERTIAL, *TRACKERS,
)  # fmt: skip
