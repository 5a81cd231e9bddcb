"""``python -m validation.rigs.generate SEED … [--out DIR]``: the folders of seeds, to look at."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from validation.rigs.cases import Case, draw, secret
from validation.rigs.files import write


def make(seed: int, folder: Path) -> Case:
    """Draw and write the case of a seed."""
    case = draw(seed)
    write(case, folder)
    return case


def main(arguments: Sequence[str] | None = None) -> int:
    """Write folders; seeds of an evaluation are refused: nobody looks at them singly."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("seeds", type=int, nargs="+", help="one folder each")
    parser.add_argument("--out", type=Path, default=Path("out/rigs/generated"))
    options = parser.parse_args(arguments)
    closed = [s for s in options.seeds if secret(s)]
    if closed:
        parser.error(f"seeds {closed} are an evaluation's, of which only totals are looked at")
    for seed in options.seeds:
        make(seed, options.out / f"r{seed}")
        print(options.out / f"r{seed}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
