"""An IOC for EPICS: motors, parameters and status bits of controllers as records.

``pip install 'stagewire[epics]'`` installs what this package needs. ``stagewire ioc`` runs it. See
``docs/how-to/epics.md``.
"""
