"""The guarded link to a controller: it refuses forbidden messages, keeps a log, and sends frames whole.

:mod:`.line` is the common base of :mod:`.apt_line` (frames) and :mod:`.command_line` (commands). The guards
(:mod:`.apt_guard`, :mod:`.command_guard`) refuse forbidden messages before a byte is sent.
"""
