"""``stagewire conformance``: whether codecs and controllers do what the documents say.

One module a command.
"""

from __future__ import annotations

import typer

from stagewire_cli.conformance import codec, device, examples, pics, rules

__all__ = ["EXAMPLE", "app"]

EXAMPLE = examples.EXAMPLE

app = typer.Typer(
    help="Check codecs and controllers against the documents.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
app.command("examples", epilog=examples.EXAMPLE)(examples.examples)
app.command("codec", epilog=codec.EXAMPLE)(codec.codec)
app.command("device", epilog=device.EXAMPLE)(device.device)
app.command("pics", epilog=pics.EXAMPLE)(pics.pics)
app.command("rules", epilog=rules.EXAMPLE)(rules.rules)


@app.callback(epilog=EXAMPLE)
def _group() -> None:
    """Check codecs and controllers against the documents."""
