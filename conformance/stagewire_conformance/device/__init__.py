"""The suite for controllers on a wire: whether one does what the document of its protocol says.

::

    declared = declare("TDC001")                       # or of a PICS: what is claimed, place by place
    allowed = Permissions(motion=Range.parse("0..5mm"))
    checks = plan(declared, allowed, only=["answers"])
    report = run(link, checks, declared, allowed, seed=1)

A **check** looks at one thing that a controller has to do. It is a function that gets a :class:`.Trial`. A
decorator (:meth:`.Kind.check`) declares what it covers, what it needs and what it does, and makes a
:class:`.Check` of it for each place of a controller. A **kind** (:class:`.Kind`) is a row of the report, with
the rules of the document that its checks hold a controller to. ``docs/how-to/conformance-checks.md``
shows how to write a check.

What a check can rely on:

- **Nothing is sent that was not allowed.** The line refuses it by the message's effect in the registry
  (:mod:`.lines.apt_guard`, :mod:`.lines.command_guard`), whatever a check tries.
- **Whatever ends it, what moves is stopped first**, and then what it noted by :meth:`.Trial.undo` is put back
  (:mod:`.run`, :class:`.Restoration`): at its end, on an error in it, on Ctrl-C and SIGTERM.
- **Time is that of the line.** Nothing sleeps; waiting is listening. So a run in memory takes no time, and is
  the same every time.
- **It begins in quiet.** Bytes that came after the check before it were read, and are noted there.
- **Chance is seeded** by the run and the id of the check, so that ``--only`` repeats it byte for byte.

==============================  =========================================================================
what                            where
==============================  =========================================================================
declared of a controller        :mod:`.pics` (a file of it, and a first one by asking),
                                :mod:`.declaration`, :mod:`.targets`
may be done to it               :mod:`.permissions`
the line to it                  :mod:`.lines`
checks, and their run           :mod:`.checks`, :mod:`.plans`, :mod:`.execution`, :mod:`.run`,
                                :mod:`.trial`
rules, and what sees them       :mod:`stagewire_conformance.registry`, :mod:`.rules_page`
was found                       :mod:`.report`, :mod:`.results`
==============================  =========================================================================
"""
