"""All faults planted in the firmware of the corpus, with the names of their controllers."""

from __future__ import annotations

from corpus_faults_ms2000_bytes import FAULTS as MS2000_BYTES
from corpus_faults_ms2000_motion import FAULTS as MS2000_MOTION
from corpus_faults_rack_bytes import FAULTS as RACK_BYTES
from corpus_faults_rack_motion import FAULTS as RACK_MOTION
from corpus_faults_stepper_bytes import FAULTS as STEPPER_BYTES
from corpus_faults_stepper_motion import FAULTS as STEPPER_MOTION
from corpus_faults_stepper_targets import FAULTS as STEPPER_TARGETS
from corpus_faults_tdc001_bytes import FAULTS as TDC001_BYTES
from corpus_faults_tdc001_commands import FAULTS as TDC001_COMMANDS
from corpus_faults_tdc001_commands import SHORT
from corpus_faults_tdc001_motion import FAULTS as TDC001_MOTION
from corpus_faults_tdc001_reports import FAULTS as TDC001_REPORTS
from corpus_faults_tdc001_settings import FAULTS as TDC001_SETTINGS
from corpus_faults_tdc001_targets import FAULTS as TDC001_TARGETS
from corpus_faults_z8 import FAULTS as Z8

FAULTS = {
    "tdc001": (
        *TDC001_MOTION,
        *TDC001_REPORTS,
        *TDC001_BYTES,
        *TDC001_SETTINGS,
        *TDC001_TARGETS,
        *TDC001_COMMANDS,
    ),
    "short": SHORT,
    "z8": Z8,
    "stepper": (*STEPPER_MOTION, *STEPPER_BYTES, *STEPPER_TARGETS),
    "rack": (*RACK_MOTION, *RACK_BYTES),
    "ms2000": (*MS2000_MOTION, *MS2000_BYTES),
}
EVERY = [(name, fault) for name, faults in FAULTS.items() for fault in faults]
"""Each fault, with the name of its controller."""
