"""Lets these tests share `situations`: with importlib imports, pytest leaves their folder off the path."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
