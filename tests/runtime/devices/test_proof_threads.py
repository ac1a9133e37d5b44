"""Eight threads use one device: every reply is matched to its own call."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from typing import Any

from proof_calls import fields_of, layouts
from proof_controller import HOST, Controller, answers_of
from proof_queue import QueueLink

from stagewire import Frame
from stagewire_apt import TDC001
from stagewire_apt import messages as m

ROUNDS = 150
QUERIES: dict[str, Any] = {
    "get_pos_counter": m.MotGetPosCounter,
    "get_enc_counter": m.MotGetEncCounter,
    "get_vel_params": m.MotGetVelParams,
    "get_gen_move_params": m.MotGetGenMoveParams,
    "get_move_abs_params": m.MotGetMoveAbsParams,
    "get_move_rel_params": m.MotGetMoveRelParams,
    "get_dc_pid_params": m.MotGetDcPidParams,
    "get_button_params": m.MotGetButtonParams,
}


class Counting(Controller):
    """A controller that answers with the count of requests of this kind, in every field that can hold it."""

    def __init__(self) -> None:
        super().__init__()
        self.counts = dict.fromkeys(QUERIES.values(), 0)

    def answer(self, frame: Frame) -> Iterable[tuple[float, bytes]]:
        self.heard.clear()
        cls = answers_of()[type(frame.message)]
        self.counts[cls] += 1
        values = {
            field["name"]: self.counts[cls]
            for field in fields_of(layouts()[cls.__name__])
            if field["name"] != "chan_ident" and field["role"] == "value"
        }
        return [(0.0, Frame(cls(chan_ident=1, **values), HOST, frame.dest).encode())]


def test_no_reply_is_matched_to_another_call() -> None:
    """Two of the eight threads make each kind of request; each reply must be newer than the previous one."""
    controller = Counting()
    wrong: list[str] = []
    with TDC001.open(QueueLink(controller), identify=False, on_close="leave", timeout=10) as tdc:

        def ask(names: list[str]) -> None:
            newest = dict.fromkeys(names, 0)
            try:
                for number in range(ROUNDS):
                    name = names[number % len(names)]
                    message = getattr(tdc, name)().message
                    numbers = {
                        getattr(message, field["name"])
                        for field in fields_of(layouts()[type(message).__name__])
                        if field["name"] != "chan_ident" and field["role"] == "value"
                    }
                    if type(message) is not QUERIES[name] or len(numbers) != 1:
                        wrong.append(f"{name}: {message}")
                    elif (count := numbers.pop()) <= newest[name]:
                        wrong.append(f"{name}: {count} after {newest[name]}")
                    else:
                        newest[name] = count
            except Exception as error:
                wrong.append(f"{names}: {error!r}")

        names = list(QUERIES)
        threads = [
            threading.Thread(target=ask, args=([names[at], names[(at + 1) % 8]],))
            for at in range(8)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60)
            assert not thread.is_alive()
    assert wrong == []
    assert sum(controller.counts.values()) == 8 * ROUNDS
