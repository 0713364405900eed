"""`python -m tools.eyes`."""

import sys

from tools.eyes.cli import main

sys.exit(main())
