"""`python -m torc.grasping.training`."""

import sys

from torc.grasping.training.cli import main

sys.exit(main())
