"""Draw the pictures of ``stagewire panel`` in the documentation.

``python tools/panel_pictures.py`` writes them. They show virtual controllers in states that are set here, so
their text is always the same, and a test compares it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from stagewire_cli.panel.app import PanelApp
from stagewire_cli.panel.axis import Axis
from stagewire_cli.panel.session import Line, axes_of
from stagewire_cli.panel.stops import Stops
from stagewire_cli.status import Value

IMAGES: Final = Path(__file__).parents[1] / "docs" / "images"
LINES: Final = Line.each(
    [
        "virtual://KDC101?stage=MTS50-Z8&serial_number=27000001",
        "virtual://KDC101?stage=PRM1-Z8&serial_number=27000002",
        "virtual://MS2000",
    ],
    unit=["KDC101", "KDC101", "MS2000"],
    stage=["MTS50-Z8", "PRM1-Z8", None],
    travel=["50", None, None],
)


def _moving(axes: list[Axis]) -> None:
    """Put the axes into the states of the pictures."""
    linear, rotary, microscope = axes
    linear.view = replace(
        linear.view,
        position=Value(18.4213, "mm"),
        moving=True,
        homed=True,
        action="go to 25 mm",
    )
    rotary.view = replace(
        rotary.view,
        position=Value(-12.5, "deg"),
        alerts=("forward_hardware_limit",),
        note="jog -10 deg: stopped at -12.5000 deg",
    )
    microscope.view = replace(microscope.view, position=Value(1200.0, "um"))


def _lost(axes: list[Axis]) -> None:
    """Put them into the same states, and lose the second line."""
    _moving(axes)
    note = "/dev/ttyUSB1: the port was unplugged"
    axes[1].view = replace(axes[1].view, lost=True, silent="lost", failed=True, note=note)


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture of the panel.

    :param size: columns and rows of the terminal.
    :param put: a function that puts the axes into their states.
    :param keys: the keys to press before it is drawn.
    """

    size: tuple[int, int]
    put: Callable[[list[Axis]], None]
    keys: tuple[str, ...] = ()


PICTURES: Final = {
    "panel.svg": Picture((100, 30), _moving),
    "panel-go-to.svg": Picture((80, 24), _moving, ("g", "3", "0")),
    "panel-lost.svg": Picture((80, 24), _lost, ("down",)),
}
"""Name of a file in ``docs/images`` -> its picture."""


def svg(picture: Picture) -> str:
    """Return a picture as SVG."""
    return asyncio.run(_drawn(picture))


async def _drawn(picture: Picture) -> str:
    from stagewire_cli.devices import opened

    with ExitStack() as stack:
        axes = []
        for line in LINES:
            device = stack.enter_context(opened(line.url, line.unit, **line.options))
            axes.append(axes_of(device, line.url)[0][0])
        picture.put(axes)
        stops = Stops(())
        stack.callback(stops.close, 1.0)
        app = PanelApp(axes, stops)
        async with app.run_test(size=picture.size) as pilot:
            await pilot.press(*picture.keys)
            await pilot.pause()
            return app.export_screenshot(title="stagewire panel")


def main() -> None:
    """Write all pictures."""
    IMAGES.mkdir(exist_ok=True)
    for name, picture in PICTURES.items():
        (IMAGES / name).write_text(svg(picture), encoding="utf-8")


if __name__ == "__main__":
    main()
