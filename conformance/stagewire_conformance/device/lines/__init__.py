"""The line to a controller as checks have it: guarded, recorded, interrupted only between frames.

:mod:`.line` is what :mod:`.apt_line` (frames) and :mod:`.command_line` (commands) have in common. A guard
(:mod:`.apt_guard`, :mod:`.command_guard`) refuses what was not allowed, before a byte is sent.
"""
