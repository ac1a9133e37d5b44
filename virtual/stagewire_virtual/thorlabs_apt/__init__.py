"""Virtual controllers of Thorlabs APT; pages in docstrings are those of the document.

Bytes come to an :class:`~stagewire_virtual.thorlabs_apt.instrument.AptInstrument`, which hands each frame to
the controller at its address (:mod:`~stagewire_virtual.thorlabs_apt.controller`). That one answers by the
registry (:mod:`~stagewire_virtual.thorlabs_apt.facts`) and by the behaviours of its channels
(:mod:`~stagewire_virtual.thorlabs_apt.behaviour`). Everything that it says passes one outlet
(:mod:`~stagewire_virtual.thorlabs_apt.outlet`), where it may be withheld, or made odd.
"""
