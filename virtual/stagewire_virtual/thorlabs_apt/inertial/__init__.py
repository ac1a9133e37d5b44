"""Inertial piezo drives: KIM101, KIM001, TIM101 and PDXC2."""
