"""Draw the pictures of ``stagewire panel`` in the documentation: ``python tools/panel_pictures.py``.

The pictures show virtual controllers in states that are set here, so they are always the same. A test
compares them with the files.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

from stagewire_cli.panel.app import PanelApp
from stagewire_cli.panel.axis import Axis
from stagewire_cli.panel.session import _axes_of
from stagewire_cli.panel.stops import Stops
from stagewire_cli.status import Value

IMAGES = Path(__file__).parent.parent / "docs/images"


def _axes(stack: ExitStack) -> list[Axis]:
    """Open virtual controllers, and return their axes in the states of the pictures."""
    from stagewire_apt import KDC101
    from stagewire_ms2000 import MS2000

    kdc = stack.enter_context(
        KDC101.open(
            "virtual://KDC101?stage=MTS50-Z8&serial_number=27000001",
            stage="MTS50-Z8",
            travel_mm=50,
        )
    )
    rotary = stack.enter_context(
        KDC101.open("virtual://KDC101?stage=PRM1-Z8&serial_number=27000002", stage="PRM1-Z8")
    )
    asi = stack.enter_context(MS2000.open("virtual://MS2000"))
    stack.enter_context(asi.low_level())
    first, second, third, *_ = [
        axis for device in (kdc, rotary, asi) for axis in _axes_of(device, device.url)[0]
    ]
    first.view = replace(
        first.view, position=Value(18.4213, "mm"), moving=True, homed=True, action="go to 25 mm"
    )
    second.view = replace(
        second.view,
        position=Value(-12.5, "deg"),
        homed=False,
        alerts=("forward_hardware_limit",),
        note="jog +10 deg: stopped at -12.5000 deg",
    )
    third.view = replace(third.view, position=Value(1200.0, "um"))
    return [first, second, third]


async def _draw(
    size: tuple[int, int], *keys: str, edit: Callable[[list[Axis]], None] | None = None
) -> str:
    with ExitStack() as stack:
        axes = _axes(stack)
        if edit is not None:
            edit(axes)
        app = PanelApp(axes, Stops(()))
        async with app.run_test(size=size) as pilot:
            await pilot.press(*keys)
            await pilot.pause()
            return app.export_screenshot(title="stagewire panel")


def _lost(axes: list[Axis]) -> None:
    axes[1].view = replace(
        axes[1].view,
        lost=True,
        silent="lost",
        failed=True,
        note="/dev/ttyUSB1: the port was unplugged",
    )


def pictures() -> dict[str, str]:
    """Return each picture as SVG, by the name of its file."""
    with patch.dict("os.environ", {"TERM": "xterm-256color"}):
        return {
            "panel.svg": asyncio.run(_draw((100, 30))),
            "panel-go-to.svg": asyncio.run(_draw((80, 24), "g", "3", "0")),
            "panel-lost.svg": asyncio.run(_draw((80, 24), "down", edit=_lost)),
        }


if __name__ == "__main__":
    IMAGES.mkdir(exist_ok=True)
    for name, picture in pictures().items():
        (IMAGES / name).write_text(picture, encoding="utf-8")
