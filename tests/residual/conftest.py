"""Puts the checkout on the path, so that tests share `tests/cases` whichever way pytest is
started."""

import sys
from pathlib import Path

ROOT = str(Path(__file__).resolve().parents[2])
if ROOT not in sys.path:
    sys.path.insert(0, ROOT)
