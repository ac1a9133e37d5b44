"""How names of the registry become names of classes; lint rules and targets agree on it here."""

from __future__ import annotations

from stagewire_generator.model import Message

__all__ = ["camel", "message_classes"]


def camel(name: str) -> str:
    """Return ``jog_mode`` as ``JogMode``."""
    return "".join(part.capitalize() for part in name.split("_"))


def message_classes(message: Message) -> dict[str, str]:
    """Return form -> class name of a message.

    The layout with the plain form ``data``, or the only layout, takes the plain name; the others
    append their form.
    """
    forms = [layout.form for layout in message.layouts]
    plain = forms[0] if len(forms) == 1 else "data"
    names = {}
    for form in forms:
        suffix = "" if form == plain else form.removeprefix("data:").capitalize()
        names[form] = message.class_name + suffix
    return names
