"""``python -m cvxupdate``: the command line where its script is not on the path."""

from cvxupdate.cli import main

main()
