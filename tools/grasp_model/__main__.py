"""`python -m tools.grasp_model`."""

import sys

from tools.grasp_model.cli import main

sys.exit(main())
