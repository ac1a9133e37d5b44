"""Renders the page from a sheet."""

from __future__ import annotations

import hashlib
from base64 import b64encode
from typing import Any

from stagewire import __version__
from stagewire_conformance.reports.html.view import View
from stagewire_conformance.reports.model import Sheet
from stagewire_conformance.reports.wording import safe

__all__ = ["as_html"]

_PACKAGE = "stagewire_conformance.reports.html"


def as_html(sheet: Sheet) -> str:
    """Return a whole page, as text that is to be written in UTF-8.

    Raises :class:`ModuleNotFoundError` without the extra ``conformance``.
    """
    import jinja2
    from markupsafe import Markup

    def shown(value: Any) -> Any:
        """Escape what no one can see, in whatever a template shows; autoescape does the rest."""
        return value if isinstance(value, Markup) or not isinstance(value, str) else safe(value)

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(_PACKAGE),
        undefined=jinja2.StrictUndefined,
        autoescape=True,
        finalize=shown,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    style = environment.get_template("style.css.j2").render()
    digest = b64encode(hashlib.sha256(style.encode("utf-8")).digest()).decode("ascii")
    return environment.get_template("page.html.j2").render(
        view=View(sheet), sheet=sheet, style=Markup(style), style_digest=digest, version=__version__
    )
