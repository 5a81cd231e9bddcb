"""The studies: ``python -m validation.studies NAME … [--out DIR]``; without a name, their list.

Each prints its table and leaves its figures in DIR/NAME, by default out/studies/NAME.
"""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Sequence
from pathlib import Path

from validation.studies.wish import Wish

HERE = Path(__file__).resolve().parent
PARTS = ("__init__", "__main__", "bay_case", "classic_loop", "wish")
OUT = Path("out") / "studies"
BLANK = "\n\n"


def names() -> list[str]:
    """The studies, by the names of their files."""
    return sorted(p.stem for p in HERE.glob("*.py") if p.stem not in PARTS)


def perform(name: str, folder: Path, wish: Wish) -> object:
    """One study into a folder of its own, which is made; gives what the study found."""
    folder.mkdir(parents=True, exist_ok=True)
    return importlib.import_module(f"validation.studies.{name}").main(folder, wish)


def listed() -> str:
    """Every study with the first sentence of what it says of itself."""
    lines = []
    for name in names():
        about = importlib.import_module(f"validation.studies.{name}").__doc__ or ""
        lines.append(f"{name:20s} {' '.join(about.partition(BLANK)[0].split())}")
    return "\n".join(lines)


def parsed(words: Sequence[str] | None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser("python -m validation.studies", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", choices=[*names(), "all", []])
    parser.add_argument("--out", type=Path, default=OUT, help="the folder of all (%(default)s)")
    parser.add_argument("--draws", type=int, help="draws of noise at each level")
    parser.add_argument("--levels", type=float, nargs="+", default=(), help="levels of noise")
    parser.add_argument("--every", action="store_true", help="every variant; takes much longer")
    parser.add_argument("--quick", action="store_true", help="each part once, on one case")
    return parser.parse_args(words)


def main(words: Sequence[str] | None = None) -> None:
    """The studies that are named, or their list."""
    asked = parsed(words)
    if not asked.names:
        print(listed())
    wish = Wish(asked.draws, tuple(asked.levels), asked.every, asked.quick)
    for name in names() if "all" in asked.names else asked.names:
        perform(name, asked.out / name, wish)


if __name__ == "__main__":
    main()
