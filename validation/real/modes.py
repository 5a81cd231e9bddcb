"""`identify` on every public set, from a raw file or a block of `problems/real` to modes in one
command, beside what the sets' READMEs state.

``CVXUPDATE_DATA=/path/to/data python -m validation.real.modes`` prints the table; ``--write`` puts
it into docs/identification.md. ``--blocks`` writes the [[recordings]] of DROPBEAR's rests anew.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cvxupdate.commands.identified import Identified
from cvxupdate.commands.identify import Options, identify
from cvxupdate.errors import CvxupdateError
from validation.real import table

ROOT = table.PROBLEMS.parents[1]
PAGE = ROOT / "docs" / "identification.md"
RESTS = table.PROBLEMS / "dropbear-moving-support" / "problem_rests.toml"
BEGIN, END = "<!-- public sets -->", "<!-- end -->"
SHOWN = 6  # frequencies in a cell


PLAIN = Options()


@dataclass(frozen=True)
class Trial:
    """One command: ``file`` (of `problems/real`, or raw where ``raw``) with ``options``;
    ``stated`` the README's frequencies (Hz) and ``within`` how far ours may be from them, relative
    (its own scatter or resolution)."""

    data: str
    file: str
    options: Options = PLAIN
    stated: tuple[float, ...] = ()
    within: tuple[float, ...] = ()
    raw: bool = False
    remark: str = ""

    @property
    def path(self) -> Path:
        """The file itself; raises where the set is not there."""
        root = table.data_root()
        if root is None or not (root / self.data).is_dir():
            raise FileNotFoundError(f"{self.data} is not under CVXUPDATE_DATA")
        return (root if self.raw else table.PROBLEMS) / self.data / self.file

    @property
    def command(self) -> str:
        """As it is typed."""
        where = "$CVXUPDATE_DATA" if self.raw else "problems/real"
        return " ".join([f"{where}/{self.data}/{self.file}", self.options.line()]).strip()

    def found(self) -> Identified | str:
        """What `identify` says, or why it refuses."""
        try:
            return identify(self.path, self.options)
        except CvxupdateError as error:
            return str(error)


FIRST = replace(Options(), band=(5.0, 60.0))
TRIALS: tuple[Trial, ...] = (
    Trial(
        "beam-six-masses-frf",
        "problem.toml",
        Options(band=(10.0, 60.0), recording="1"),
        (21.87,),
        (2.0 * 0.23 / 21.87,),
        remark="README: median of 70 layouts; within twice their scatter",
    ),
    Trial(
        "beam-six-masses-frf",
        "problem.toml",
        Options(recording="1"),
        (138.7, 381.0, 738.7, 1154.0),
        (2.0 * 0.8 / 138.7, 2.0 * 3.8 / 381.0, 2.0 * 7.5 / 738.7, 2.0 * 8.8 / 1154.0),
        remark="the same",
    ),
    *(
        Trial(
            "cristallo-3storey-frame",
            f"{name}.csv",
            stated=(6.50, 17.47, 26.50),
            within=(0.03125 / 6.5, 0.03125 / 17.47, 0.03125 / 26.5),
            raw=True,
            remark="README: peaks; within a line",
        )
        for name in ("Experimental", "test_2", "test_3")
    ),
    *(
        Trial(
            "unb-cantilever-tip-mass",
            file,
            replace(FIRST, recording=which),
            (stated,),
            (0.03,),
            remark="hammer; the rig softens by 3 % with the amplitude",
        )
        for file, which, stated in (
            ("problem_massa1.toml", "1", 11.23),
            ("problem.toml", "1", 19.92),
            ("problem.toml", "2", 19.86),
            ("problem_massa4.toml", "1", 22.81),
            ("problem_massa4.toml", "2", 22.79),
            ("problem_massa4.toml", "3", 22.84),
        )
    ),
    Trial(
        "silverbox",
        "problem_schroeder.toml",
        Options(recording="1"),
        (69.85,),
        (0.025,),
        remark="README: the peak moves from 68.2 to 71.5 with the level; one linear mode of it",
    ),
    Trial(
        "dropbear-moving-support",
        "problem_rests.toml",
        Options(band=(15.0, 200.0), order=30),
        remark="README: 26.1, 28.2, 30.8, 33.9, 37.5, 42.0 by the roller's place",
    ),
    Trial("friction-damper-backlash", "problem.toml", remark="no structure is attached"),
    Trial("smu-modal-data", "problem_footbridge.toml", remark="modes already"),
)


def nearest(found: Identified, stated: Sequence[float]) -> list[float]:
    """Of all modes the one next to each stated frequency, Hz."""
    f = np.concatenate([s.frequency for s in found.sets])
    return [float(f[np.argmin(np.abs(f - x))]) for x in stated]


def left_out(line: str) -> str:
    """Of a recording without modes, the poles that were named in its stead."""
    name, _, why = line.partition(":")
    poles = re.search(r"stable poles at ([\d., ]+) Hz", why)
    return f"{name}: {f'({poles[1]})' if poles else 'none'}"


def rows() -> Iterator[list[str]]:
    """The table, line by line."""
    for t in TRIALS:
        found = t.found()
        if isinstance(found, str):
            said, error = f"none: {found.split('; ')[0].split(': ', 1)[-1]}", "–"
        else:
            said = "; ".join(
                (f"{s.recording}: " if len(found.sets) > 1 else "")
                + ", ".join(f"{f:.5g}" for f in s.frequency[:SHOWN])
                for s in found.sets
            )
            said = "; ".join([said, *map(left_out, found.skipped)])
            far = [
                abs(a / b - 1.0) for a, b in zip(nearest(found, t.stated), t.stated, strict=True)
            ]
            error = f"{100.0 * max(far):.2f} %" if far else "–"
        stated = ", ".join(f"{x:g}" for x in t.stated) or "–"
        yield [t.data, f"`{t.command}`", said, stated, error, t.remark]


def text() -> str:
    """Markdown."""
    head = ["set", "`cvxupdate identify …`", "found (Hz)", "README (Hz)", "nearest mode off by", ""]
    lines = [head, ["---"] * len(head), *rows()]
    return "\n".join(
        "| " + " | ".join(cell.replace("|", "/") for cell in row) + " |" for row in lines
    )


def blocks() -> str:
    """[[recordings]] of the rests of the roller in DROPBEAR's first test, with the samples of each:
    while the roller moves, the structure is another from sample to sample."""
    record = table.load("dropbear-moving-support")[0]
    out = [
        'title = "Cantilever with its roller at rest, ten rests of test 0"\n'
        'source = "High-Rate-SHM-Working-Group/Dataset-8-DROPBEAR; see source.md"\n\n'
        '[model]\ninclude = "coarse.toml"\n'
    ]
    for k, (_, part) in enumerate(table.rests(record), start=1):  # type: ignore[arg-type]
        out.append(
            f'[[recordings]]\nkind = "time"\nname = "rest {k}"\n'
            'dataset = "dropbear-moving-support"\nfile = "slow10steps_test0.txt"\n'
            f"time_column = 3\nstart = {int(part.start)}\nstop = {int(part.stop)}\n"
            "channels = [\n"
            '  { column = 0, quantity = "voltage", unit = "V", name = "Low-G accelerometer" },\n'
            '  { column = 1, quantity = "voltage", unit = "V", name = "accelerometer" },\n]\n'
        )
    return "\n".join(out)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print or write the table, or write the blocks."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--write", action="store_true", help="into docs/identification.md")
    parser.add_argument("--blocks", action="store_true", help="DROPBEAR's rests anew")
    options = parser.parse_args(arguments)
    if options.blocks:
        RESTS.write_text(blocks(), encoding="utf-8")
        return 0
    made = text()
    if options.write:
        page = PAGE.read_text(encoding="utf-8")
        before, _, rest = page.partition(BEGIN)
        after = rest.partition(END)[2]
        PAGE.write_text(f"{before}{BEGIN}\n{made}\n{END}{after}", encoding="utf-8")
    print(made)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
