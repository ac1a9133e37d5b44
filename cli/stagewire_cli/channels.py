"""Enabling a channel before its motion, and the step that a controller stores for jogs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.status import in_words, numbers_of

_JOG_PARAMS = (
    ("get_jog_params", ("jog_step_size",)),
    ("get_kcube_jog_params", ("jog_step_size_fwd", "jog_step_size_rev")),
    ("get_tim_jog_params", ("jog_step_size",)),
    ("get_pdxc2_jog_params", ("open_loop_step_size",)),
    ("get_params", ("jog_step{number}",)),
)
"""Calls that read the jog parameters, and their steps: one, or one in each direction.

If the call is of the controller, a step has the number of its channel.
"""


def jog_step(device: Any, part: Any, direction: str, number: str) -> str:
    """Return the stored step of a jog in words.

    :param number: number of the channel.
    """
    for name, steps in _JOG_PARAMS:
        holder = part if hasattr(part, name) else device
        if hasattr(holder, name):
            stored = getattr(holder, name)()
            field = steps[-1] if direction.upper().startswith("R") else steps[0]
            field = field.format(number=number)
            step = in_words(numbers_of(stored).get(field), "an unknown distance")
            mode = getattr(stored, "jog_mode", None)
            return f"the stored step of {step}" + (
                "" if mode is None else f" ({getattr(mode, 'name', mode)})"
            )
    return "its stored step"


def enabling(enable: bool, device: Any) -> str:
    """Return how an announcement begins that also enables a channel."""
    if not enable:
        return ""
    how = device.unit.enabling
    others = ", disable the others" if how is not None and how.disables_others else ""
    return f"enable the channel{others} and "


def after_enabling(
    enable: bool, device: Any, part: Any, start: Callable[[], Any]
) -> Callable[[], Any]:
    """Return a function that enables a channel and starts a motion; just the start without ``enable``."""
    if not enable:
        return start
    switch_on = getattr(part, "enable", None)
    if switch_on is None:
        raise CalledWronglyError(f"{device.unit.name} has no channel to enable; leave out --enable")

    def begin() -> Any:
        switch_on()
        return start()

    return begin
