"""Problems of our own making: from a seed a folder with ``problem.toml``, recordings and
``truth.toml``, in the form of ``problems/concealed``.

``python -m validation.generate SEED [--out DIR]``. The same seed gives the same folder, byte for
byte. A seed divisible by three has nothing concealed in it. Seeds below 1000 are for development;
1000 to 1199 are the evaluation, of which only totals are looked at (docs/calibration.md).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from validation.generated.cases import Case, draw
from validation.generated.files import write


def make(seed: int, folder: Path) -> Case:
    """Draw and write the case of a seed."""
    case = draw(seed)
    write(case, folder)
    return case


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the folders of seeds."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("seeds", type=int, nargs="+", help="one folder each")
    parser.add_argument(
        "--out", type=Path, default=Path("out/generated"), help="where the folders g<seed> go"
    )
    options = parser.parse_args(arguments)
    for seed in options.seeds:
        make(seed, options.out / f"g{seed}")
        print(options.out / f"g{seed}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
