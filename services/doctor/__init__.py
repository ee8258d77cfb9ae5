"""What this machine has and lacks for Incognita, and how to mend it."""

from services.doctor.checks import Check, run_doctor

__all__ = ["Check", "run_doctor"]
