"""The conformance suite for controllers: it tests a controller against the document of its protocol.

::

    declared = declare("TDC001")                       # a unit name, or a PICS
    allowed = Permissions(motion=Range.parse("0..5mm"))
    checks = plan(declared, allowed, only=["answers"])
    report = run(link, checks, declared, allowed, seed=1)

A **check** tests one requirement. It is a function that is called with a :class:`.Trial`. A decorator
(:meth:`.Kind.check`) declares its messages, its needs and its actions, and makes a :class:`.Check` of it for
each target of a controller. A **kind** (:class:`.Kind`) is a row of the report, with the rules of the
document that its checks test. ``docs/how-to/conformance-checks.md`` shows how to write a check.

Guarantees for checks:

- **Only allowed messages are sent.** The line refuses all others by their effect in the registry
  (:mod:`.lines.apt_guard`, :mod:`.lines.command_guard`).
- **However a check ends, motion is stopped first.** Then the changes that it registered with
  :meth:`.Trial.undo` are undone (:mod:`.run`, :class:`.Restoration`): at its end, after an error, on Ctrl-C
  and on SIGTERM.
- **Time is that of the line.** Nothing sleeps; the suite waits by reading. A run in memory takes no time and
  is reproducible.
- **A check begins with a quiet line.** Bytes that arrive after a check are read and noted there.
- **Randomness is seeded** by the run and the id of the check, so that ``--only`` repeats a check byte for
  byte.

==============================  =========================================================================
subject                         modules
==============================  =========================================================================
declared controllers            :mod:`.pics` (with a draft from a controller), :mod:`.declaration`,
                                :mod:`.targets`
permissions                     :mod:`.permissions`
the line                        :mod:`.lines`
checks and runs                 :mod:`.checks`, :mod:`.plans`, :mod:`.execution`, :mod:`.run`,
                                :mod:`.trial`
rules and their checks          :mod:`stagewire_conformance.registry`, :mod:`.rules_page`
results                         :mod:`.report`, :mod:`.results`
==============================  =========================================================================
"""
