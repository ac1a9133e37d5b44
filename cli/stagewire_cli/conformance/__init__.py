"""``stagewire conformance``: check codecs and controllers against the documents.

Each module has the options of one or two commands; the checks are in ``stagewire_conformance``.
"""

from __future__ import annotations

import typer

from stagewire_cli.conformance import codec, compare, device, documents

EXAMPLE = documents.EXAMPLES_EXAMPLE

app = typer.Typer(
    help="Test codecs and controllers against the protocol documents.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
app.command("examples", epilog=documents.EXAMPLES_EXAMPLE)(documents.examples)
app.command("codec", epilog=codec.EXAMPLE)(codec.codec)
app.command("device", epilog=device.DEVICE_EXAMPLE)(device.device)
app.command("pics", epilog=device.PICS_EXAMPLE)(device.pics)
app.command("compare", epilog=compare.EXAMPLE)(compare.compare)
app.command("rules", epilog=documents.RULES_EXAMPLE)(documents.rules)


@app.callback(epilog=EXAMPLE)
def _group() -> None:
    """Test codecs and controllers against the protocol documents."""
