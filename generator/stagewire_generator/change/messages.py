"""Messages: their ids, directions, names and exchanges; parameter sets; modules."""

from __future__ import annotations

from collections.abc import Sequence

from stagewire_generator.change.comparison import Comparison, Where
from stagewire_generator.change.layouts import compare_layouts
from stagewire_generator.model import Firmware, Message, Protocol

__all__ = ["compare_chapters", "compare_firmware", "compare_messages", "compare_sets"]


def compare_messages(comparison: Comparison, old: Protocol, new: Protocol) -> None:
    """Compare all messages."""
    pairs = comparison.matches.message
    ids: dict[tuple[str, int | None], str] = {
        (m.kind, m.id): m.name for m in old.messages if m.id is not None
    }
    for message in pairs.removed:
        kind = "mention-removed" if message.id is None else "message-removed"
        comparison.add(kind, {"message": message.name}, message.name, None)
    for message in pairs.added:
        text = ""
        owner = ids.get((message.kind, message.id))
        if owner:
            text = f"new names; frames with this id were {owner} and are now read as this message"
        kind = "mention-added" if message.id is None else "message-added"
        comparison.add(kind, {"message": message.name}, None, message.name, text)
    for before, after in pairs.kept:
        _message(comparison, before, after)


def _message(comparison: Comparison, old: Message, new: Message) -> None:
    where = {"message": new.name}
    if old.name != new.name:
        comparison.add("message-renamed", where, old.name, new.name)
    elif old.words != new.words:
        words = (" ".join(old.words), " ".join(new.words))
        comparison.add("message-words", where, *words, _class_names(old, new))
    if old.id is None and new.id is not None:
        comparison.add("message-id-added", where, None, new.id)
    elif old.id != new.id:
        text = (
            ""
            if new.id is not None
            else "the message has no id any more; its frames are no longer known"
        )
        comparison.add("message-id", where, old.id, new.id, text)
    comparison.attributes(where, old, new)
    compare_firmware(comparison, where, old.firmware, new.firmware)
    belonged = (comparison.renamed("set", old.set[0]), old.set[1]) if old.set else None
    if belonged != new.set:
        before, after = (m.set and " ".join(m.set) for m in (old, new))
        comparison.add("message-set", where, before, after)
    compare_layouts(comparison, where, old, new)


def compare_firmware(
    comparison: Comparison, where: Where, old: Sequence[Firmware], new: Sequence[Firmware]
) -> None:
    """Compare what depends on the firmware of the controller."""
    if old != new:
        before, after = (
            [
                f"{fact.version}{f' (page {fact.page})' if fact.page else ''}: {fact.note}"
                for fact in facts
            ]
            for facts in (old, new)
        )
        comparison.add("firmware", where, before, after)


def _class_names(old: Message, new: Message) -> str:
    if old.class_name == new.class_name:
        return "names in other languages may change; the Python class has the same"
    return f"the class {old.class_name} is now {new.class_name}"


def compare_sets(comparison: Comparison) -> None:
    """Compare the parameter sets and who belongs to them."""
    pairs = comparison.matches.set
    comparison.names("set", "set", pairs)
    for old, new in pairs.kept:
        members = {r: comparison.renamed("message", m) for r, m in old.members.items()}
        if members != dict(new.members):
            comparison.add("set-members", {"set": new.name}, dict(old.members), dict(new.members))


def compare_chapters(comparison: Comparison, old: Protocol, new: Protocol) -> None:
    """Compare the chapters, and the modules that those with messages become."""
    pairs = comparison.matches.chapter
    modules, new_modules = _modules(old), _modules(new)
    for chapter in pairs.removed:
        kind = "module-removed" if chapter.name in modules else "chapter-removed"
        comparison.add(kind, {"chapter": chapter.name}, chapter.name, None)
    for chapter in pairs.added:
        kind = "module-added" if chapter.name in new_modules else "chapter-added"
        comparison.add(kind, {"chapter": chapter.name}, None, chapter.name)
    for before, after in pairs.kept:
        where = {"chapter": after.name}
        was, is_ = before.name in modules, after.name in new_modules
        if was != is_:
            ends = (None, after.name) if is_ else (before.name, None)
            comparison.add("module-added" if is_ else "module-removed", where, *ends)
        elif before.name != after.name:
            kind = "module-renamed" if is_ else "chapter-renamed"
            comparison.add(kind, where, before.name, after.name)
        comparison.attributes(where, before, after)


def _modules(protocol: Protocol) -> set[str]:
    """Return the chapters that become modules: those with a message that has an id."""
    return {message.chapter for message in protocol.messages if message.id is not None}
