"""The part of the set-up that follows the packages: a driver for the simulator."""

import sys

from services.doctor.vulkan import ensure_driver

sys.exit(0 if ensure_driver() else 5)
