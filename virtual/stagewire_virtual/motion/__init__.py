"""How things move: profiles of motion, and axes that follow them.

Knows no protocol, no message and no unit of length: positions are counts, velocities counts/s, accelerations
counts/s², jerks counts/s³, and times whole nanoseconds.
"""

from stagewire_virtual.motion.axis import Axis
from stagewire_virtual.motion.profile import Profile, Segment
from stagewire_virtual.motion.s_curve import s_curve
from stagewire_virtual.motion.trapezoid import run_on, stop, trapezoid

__all__ = ["Axis", "Profile", "Segment", "run_on", "s_curve", "stop", "trapezoid"]
