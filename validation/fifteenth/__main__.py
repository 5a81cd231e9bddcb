"""``python -m validation.fifteenth OUTDIR [CASE…]`` writes the cases, or those that are named."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from validation.fifteenth.cases import every_case
from validation.fifteenth.simulate import run


def main(args: list[str]) -> int:
    """2, and one line, where the folder is not said or a case is not known."""
    cases = {case.name: case for case in every_case()}
    unknown = [name for name in args[1:] if name not in cases]
    if not args or unknown:
        what = f"no case is called {unknown[0]}" if unknown else "say the folder to write to"
        print(f"validation.fifteenth: {what}. Cases: {', '.join(cases)}", file=sys.stderr)
        return 2
    for name in args[1:] or cases:
        begin = time.perf_counter()
        line = run(cases[name], Path(args[0]) / name)
        print(f"{line}  {time.perf_counter() - begin:.1f} s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
