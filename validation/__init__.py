"""What validates cvxupdate on problems with a known answer, and makes those problems; not part of
the package."""

import os

# Cases are the processes here: each takes one processor, and its seconds are those of one.
os.environ.setdefault("CVXUPDATE_JOBS", "1")
