"""Make the problem files that `cvxupdate diagnose` is tried with on real recordings, and the models
that they share: `problem_diagnose_*.toml` in the folders of problems/real.

Run: CVXUPDATE_DATA=/path/to/data python -m validation.real.problem_files            (a few seconds;
the files are kept in the repository)

Frequencies are read from the recordings here, because the recordings are decays and spectra without
a force, or FRFs of seventy layouts. What was changed on the structure is not in these files: it is
in truth.toml, which no command opens.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.identify import identify_modes
from cvxupdate.recordings.lines import frf_peaks
from cvxupdate.recordings.types import FrequencyResponse, TimeHistory
from cvxupdate.residual.shape_rows import real_shapes
from validation.real import table

Row = tuple[int, float, float]  # flexible mode of the model, frequency and its deviation in Hz


def block(name: str, rows: Sequence[str]) -> str:
    """A list of inline tables, one to a line."""
    return f"{name} = [\n" + "".join(f"  {{ {row} }},\n" for row in rows) + "]\n"


def mode_rows(rows: Sequence[Row], use: str, name: str, state: str = "") -> str:
    """A table of modes paired with the model's; ``state`` of the structure, where it has one."""
    stated = f'state = "{state}"\n' if state else ""
    listed = [
        f"frequency = {f:.6g}, frequency_std = {std:.3g}, mode = {mode}" for mode, f, std in rows
    ]
    return f'[[recordings]]\nkind = "modes"\nuse = "{use}"\n{stated}name = "{name}"\n' + block(
        "rows", listed
    )


def bar(xs: Sequence[float], material: str, section: str) -> str:
    """Nodes, material, section and beam elements of a straight bar along x that bends in z."""
    nodes = block("nodes", [f"id = {i + 1}, x = {x:.6g}" for i, x in enumerate(xs)])
    elements = block(
        "rows",
        [f'id = {i + 1}, nodes = [{i + 1}, {i + 2}], group = "beam"' for i in range(len(xs) - 1)],
    )
    return (
        '[model]\ndofs = ["z", '
        f'"ry"]\n{nodes}\n[model.materials.steel]\n{material}\n\n[model.sections.strip]\nshape '
        f'= "rectangle"\n{section}\n\n[[model.elements]]\ntype = "beam3d"\nmass = '
        f'"consistent"\nmaterial = "steel"\nsection = "strip"\n{elements}\n'
    )


def head(title: str, source: str) -> str:
    """Title and source."""
    return f'title = "{title}"\nsource = "{source}"\n\n'


def including(name: str) -> str:
    """A [model] that is in a file beside the problem file."""
    return f'[model]\ninclude = "{name}"\n\n'


CLAMP = '[[model.supports]]\nnodes = [1]\ndofs = ["z", "ry"]\n\n'


def only(words: Sequence[str], scatter: float = 1.0) -> str:
    """What diagnose may consider, and how much of the usual scatter is left in a calibrated
    model."""
    asked = ["physics = [" + ", ".join(f'"{w}"' for w in words) + "]"] if words else []
    return (
        "\n[diagnose]\n"
        + "\n".join(asked + ([f"scatter = {scatter:g}"] if scatter < 1.0 else []))
        + "\n"
    )


# the moving roller

ROLLER = (
    "High-Rate-SHM-Working-Group/Dataset-8-DROPBEAR; beam 51 x 6.66 x 501 mm, steel (fits); "
    "frequencies at rest read from the records by problem_files.py"
)
SECOND = np.arange(130.0, 300.0, 0.5)


CLEAR = 3.0  # mean log above which a line is one: e³ times the median of both channels' product


def second_line(parts: Sequence[np.ndarray], rate: float) -> tuple[float, float]:
    """The line between 130 and 300 Hz that both accelerometers show at every rest given, Hz, and
    how clear: mean log of |X₁ X₂| over their medians."""
    total = np.zeros(len(SECOND))
    for x in parts:
        x = x - x.mean(axis=0)
        t = np.arange(len(x)) / rate
        X = np.abs(np.exp(-2j * np.pi * np.outer(SECOND, t)) @ (x * np.hanning(len(x))[:, None]))
        total += np.log(np.prod(X / np.median(X, axis=0), axis=1)) / len(parts)
    return float(SECOND[int(np.argmax(total))]), float(total.max())


def roller_rests() -> dict[str, dict[int, list[tuple[float, np.ndarray]]]]:
    """Test name → place of the roller (0..5) → (mean volts, samples of the two accelerometers) of
    each rest there."""
    out: dict[str, dict[int, list[tuple[float, np.ndarray]]]] = {}
    for record in table.load("dropbear-moving-support"):
        if isinstance(record, TimeHistory):
            places: dict[int, list[tuple[float, np.ndarray]]] = {}
            for volts, part in table.rests(record):
                places.setdefault(round((volts - 1.227) / 0.4286), []).append(
                    (volts, record.data[part, :2])
                )
            out[record.origin.name] = places
    return out


def roller() -> dict[str, str]:
    """Six places of the roller; fitted is the test that shows the second line more clearly, held
    out the other (its second line where it is clear)."""
    tests = list(roller_rests().values())[:2]
    mesh = np.linspace(0.0, 0.501, 168).tolist()
    steel, strip = "E = 200e9\nnu = 0.3\nrho = 7850.0", "width = 0.051\nheight = 0.00666"
    files = {"bar.toml": bar(mesh, steel, strip) + CLAMP}
    title = "Cantilever, six rests of the roller in one fit: a model without the roller"
    together = head(title, ROLLER) + including("bar.toml").rstrip("\n") + "\n"
    for place in sorted(tests[0]):
        found: list[tuple[float, str, list[Row]]] = []
        for name, rests in zip(("test 0", "test 1"), (t[place] for t in tests), strict=True):
            parts = [x for _, x in rests]
            first = float(np.median([table.first_line(x[:, 1], 5000.0, 15.0, 60.0) for x in parts]))
            second, clear = second_line(parts, 5000.0)
            found.append((clear, name, [(1, first, 0.05), (2, second, 1.0)]))
        (_, fitted, rows), (clear, other, again) = sorted(
            found, reverse=True, key=lambda item: item[0]
        )
        files[f"problem_diagnose_place_{place + 1}.toml"] = (
            head(f"Cantilever, roller at rest {place + 1} of 6: a model without the roller", ROLLER)
            + including("bar.toml")
            + mode_rows(rows, "fit", fitted)
            + "\n"
            + mode_rows(again if clear > CLEAR else again[:1], "hold-out", other)
        )
        for use, its, test in (
            ("fit", rows, fitted),
            ("hold-out", again if clear > CLEAR else again[:1], other),
        ):
            name = f"rest {place + 1}, {test}"
            together += "\n" + mode_rows(its, use, name, f"rest {place + 1}")
    return files | {"problem_diagnose_rests.toml": together}


# the beam with six masses

BEAM = (
    "de Sousa and Machado, Data in Brief 2024, doi 10.1016/j.dib.2024.110043; width and steel "
    "are assumptions, see source.md"
)
SIX = 0.01275  # kg: one of six is 2.96 % of beam and masses, for a beam of 25 mm width
KNOWN = 0.1  # part of the usual scatter: the very beam was measured before, in the same clamp
REPEAT = 0.003  # relative deviation of a frequency: what a layout tested twice differs by


@dataclass(frozen=True)
class Clamp:
    """What holds the beam: springs in translation (N/m) and rotation (N·m/rad), and the mass that
    moves with them (kg)."""

    kz: float = 5e6
    kr: float = 1500.0
    mass: float = 0.05

    def text(self) -> str:
        """As elements."""
        return (
            '[[model.elements]]\ntype = "spring"\n'
            + block(
                "rows",
                [
                    f'id = 301, nodes = [1], dof = "z", k = {self.kz:.7g}, group = "clamp z"',
                    f'id = 302, nodes = [1], dof = "ry", k = {self.kr:.7g}, group = "clamp ry"',
                ],
            )
            + '\n[[model.elements]]\ntype = "mass"\n'
            + block("rows", [f'id = 303, nodes = [1], m = {self.mass:.7g}, group = "clamp mass"'])
            + "\n"
        )


def layouts() -> tuple[np.ndarray, np.ndarray]:
    """(frequencies (2 states, 70, 5) in Hz, positions (70, 6) in m as printed)."""
    recordings = [
        r
        for r in table.load("beam-six-masses-frf", "problem_all_layouts.toml")
        if isinstance(r, FrequencyResponse)
    ]
    f = np.array(
        [
            [line.frequency for line in frf_peaks(r.frequency, r.H, 5, low=10.0, high=1500.0)]
            for r in recordings[:140]
        ]
    )
    root = table.data_root()
    if root is None:
        raise RecordingError("CVXUPDATE_DATA does not name a folder.")
    with np.load(root / "beam-six-masses-frf" / "frf.npz") as arrays:
        return f.reshape(2, 70, 5), arrays["mass_positions_as_printed"] / 100.0


def beam_mesh(positions: np.ndarray) -> tuple[np.ndarray, list[int]]:
    """A node each 2 cm, the nearest ones moved to the masses: (coordinates, node number of each
    mass)."""
    xs = np.round(np.arange(0.0, 0.3801, 0.02), 6)
    at: list[int] = []
    for p in positions:
        free = [i for i in range(1, len(xs) - 1) if i not in at]
        at.append(min(free, key=lambda i: abs(xs[i] - p)))
        xs[at[-1]] = p
    order = np.argsort(xs)
    return xs[order], [int(np.flatnonzero(order == i)[0]) + 1 for i in at]


def beam(
    title: str,
    positions: np.ndarray,
    clamp: Clamp | None,
    recordings: str,
    masses: Sequence[float] = (SIX,) * 6,
    tail: str = "",
) -> str:
    """A problem file of the beam with its masses at ``positions``, written whole; rigidly clamped
    without ``clamp``."""
    return head(title, BEAM) + beam_model(positions, masses) + held(clamp) + recordings + tail


def held(clamp: Clamp | None) -> str:
    """What holds the beam, as tables of a [model]."""
    return CLAMP if clamp is None else clamp.text()


def beam_model(positions: np.ndarray, masses: Sequence[float] = (SIX,) * 6) -> str:
    """The [model] of the beam with its masses, held by nothing."""
    xs, at = beam_mesh(positions)
    lumps = block(
        "rows",
        [
            f'id = {101 + k}, nodes = [{n}], m = {m:.6g}, group = "masses"'
            for k, (n, m) in enumerate(zip(at, masses, strict=True))
        ],
    )
    steel, strip = "E = 200e9\nnu = 0.3\nrho = 7850.0", "width = 0.025\nheight = 0.00475"
    return bar(xs.tolist(), steel, strip) + f'[[model.elements]]\ntype = "mass"\n{lumps}\n'


CALIBRATE = """
[update]
method = "frequencies"
parameters = [
  { group = "clamp z", of = "k", lower = -0.95, upper = 20.0 },
  { group = "clamp ry", of = "k", lower = -0.95, upper = 20.0 },
  { group = "clamp mass", of = "m", lower = -0.95, upper = 5.0 },
]

[regularisation]
kind = "tikhonov"
weight = 0.05
"""


def medians(state: np.ndarray, positions: np.ndarray) -> tuple[list[Row], np.ndarray]:
    """Median frequencies over the layouts, as rows, and mean positions."""
    return [
        (k + 1, float(f), REPEAT * float(f)) for k, f in enumerate(np.median(state, axis=0))
    ], positions.mean(axis=0)


def beam_files() -> dict[str, str]:
    """Healthy: as drawn (rigid clamp), and with a clamp to calibrate."""
    f, positions = layouts()
    even, where = medians(f[0, ::2], positions)
    odd, _ = medians(f[0, 1::2], positions)
    fit = mode_rows(even, "fit", "medians of the healthy layouts 1, 3, 5, ...")
    other = mode_rows(odd, "hold-out", "medians of the healthy layouts 2, 4, 6, ...")
    title, shared = "Cantilever with six masses, healthy", including("medians.toml")
    return {
        "medians.toml": beam_model(where),
        "problem_diagnose_healthy.toml": head(f"{title}: rigidly clamped, as drawn", BEAM)
        + f"{shared}{held(None)}{fit}\n{other}",
        "problem_calibrate.toml": head(f"{title}: the clamp calibrated", BEAM)
        + f"{shared}{held(Clamp())}{fit}{CALIBRATE}",
    }


def damaged(
    layout: int, clamp: Clamp, measured: np.ndarray, positions: np.ndarray, words: Sequence[str]
) -> str:
    """The damaged state of a layout (from 0); ``measured`` (5,) Hz."""
    rows = mode_rows(
        [(k + 1, float(f), REPEAT * float(f)) for k, f in enumerate(measured)],
        "fit",
        f"layout {layout + 1}, 2.96 % of the mass taken off",
    )
    return beam(
        f"Cantilever with six masses, layout {layout + 1}: something was taken off",
        positions,
        clamp,
        rows,
        tail=only(words, KNOWN),
    )


# the cantilever with tip masses

UNB = (
    "carlos-adir/UnB-Courses, lab sheet: beam 25 x 6 x 350 mm, E 210 GPa, 8069 kg/m3, "
    "accelerometer 0.054 kg; the tip mass is left out"
)


def hammer(mass: str, test: str, use: str) -> str:
    """The analyser's FRF of a hammer test from 8 Hz (below, the accelerometer's own zero) to 60
    Hz."""
    channel = (
        'column = 1, pair = 2, coherence = 3, form = "db-phase", quantity = "acceleration", node '
        '= 21, dof = "z", unit = "g/N", sign = -1'
    )
    return (
        f'[[recordings]]\nkind = "frf"\nuse = "{use}"\nname = "hammer {test}"\ndataset = '
        f'"unb-cantilever-tip-mass"\nfile = "hammer/{mass}/{test}/mfc.txt"\nresponse = '
        f'"acceleration"\nfrequency_column = 0\nband = [8.0, 60.0]\nreferences = [{{ node = '
        f'21, dof = "z" }}]\nchannels = [{{ {channel} }}]\n\n'
    )


def tip_masses() -> dict[str, str]:
    """Nominal files without the tip mass."""
    tests: Mapping[str, Sequence[str]] = {
        "massa1": ("test1-1",),
        "massa3": ("test1-3", "test2-3"),
        "massa4": ("test1-4", "test2-4"),
    }
    gauge = (
        '[[model.elements]]\ntype = "mass"\nrows = [{ id = 102, nodes = [21], m = 0.054, group = '
        '"accelerometer" }]\n\n'
    )
    mesh = np.linspace(0.0, 0.35, 21).tolist()
    steel, strip = "E = 210e9\nnu = 0.3\nrho = 8069.0", "width = 0.025\nheight = 0.006"
    damping = '[model.damping]\nkind = "modal"\nzeta = 0.02\n'
    return {"nominal.toml": bar(mesh, steel, strip) + gauge + CLAMP + damping} | {
        f"problem_diagnose_{mass}.toml": head(
            f"Cantilever with its tip mass left out ({mass})", UNB
        )
        + including("nominal.toml")
        + "".join(hammer(mass, t, "hold-out" if k else "fit") for k, t in enumerate(names))
        for mass, names in tests.items()
    }


# the three-storey frame

FRAME = (
    "Digital-Twin-Operational-Platform/Cristallo; floors 5.201 kg, four legs 25 x 3 x 153.3 mm a "
    "storey, E 70 GPa: 4 x 12 EI / L^3 = 52.46 kN/m"
)


def frame_modes() -> list[list[tuple[float, float, np.ndarray]]]:
    """(frequency Hz, damping, shape) of the three modes, from each of the three files by itself."""
    out = []
    for record in table.load("cristallo-3storey-frame"):
        if isinstance(record, FrequencyResponse):
            modes = identify_modes(record, (3.0, 40.0)).to_table()
            shapes = real_shapes(modes.shapes) if modes.shapes is not None else np.zeros((0, 3))
            at = [int(np.argmin(np.abs(modes.frequency - f))) for f in (6.50, 17.47, 26.50)]
            out.append(
                [
                    (
                        float(modes.frequency[i]),
                        float(modes.damping[i]),
                        shapes[i] / shapes[i][np.argmax(np.abs(shapes[i]))],
                    )
                    for i in at
                ]
            )
    return out


def frame_table(modes: Sequence[tuple[float, float, np.ndarray]], use: str, name: str) -> str:
    """Frequencies (0.05 %: the three files agree to 0.01 %) and shapes."""
    rows = [
        f"frequency = {f:.6g}, frequency_std = {5e-4 * f:.3g}, mode = {k + 1}, shape = ["
        + ", ".join(f"{v:.4f}" for v in shape)
        + "], shape_std = 0.01"
        for k, (f, _, shape) in enumerate(modes)
    ]
    channels = block(
        "channels",
        [f'column = {k}, quantity = "displacement", node = {k + 1}, dof = "x"' for k in range(3)],
    )
    return (
        f'[[recordings]]\nkind = "modes"\nuse = "{use}"\nname = '
        f'"{name}"\n{block("rows", rows)}{channels}\n'
    )


def frame(k: Sequence[float], m: Sequence[float]) -> str:
    """The [model] of a shear chain: three storeys of stiffness ``k`` (N/m), floors of mass ``m``
    (kg)."""
    storeys = block(
        "rows",
        [
            f'id = {i}, nodes = {nodes}, k = {v:.8g}, group = "legs"'
            for i, nodes, v in zip((1, 2, 3), ("[1]", "[1, 2]", "[2, 3]"), k, strict=True)
        ],
    )
    floors = block(
        "rows",
        [
            f'id = {11 + i}, nodes = [{i + 1}], m = {v:.7g}, group = "floors"'
            for i, v in enumerate(m)
        ],
    )
    nodes = block(
        "nodes", [f"id = {i + 1}, x = 0.0, z = {z}" for i, z in enumerate((0.2018, 0.3801, 0.5584))]
    )
    return (
        f'[model]\ndofs = ["x"]\n{nodes}\n[[model.elements]]\ntype = "spring"\ndof = '
        f'"x"\n{storeys}\n[[model.elements]]\ntype = "mass"\n{floors}'
    )


STOREYS = """
[update]
method = "sensitivity"
parameters = [
  { elements = [1, 2, 3], of = "k", each = "element", lower = -0.5, upper = 0.5 },
  { elements = [11, 13], of = "m", each = "element", lower = -0.3, upper = 0.3 },
]
"""


def frame_files() -> dict[str, str]:
    """Clamped legs against test 1; storeys to calibrate on test 1."""
    tests = frame_modes()
    shared = including("clamped.toml")
    names = ("Experimental.csv", "test_2.csv", "test_3.csv")
    return {
        "clamped.toml": frame((52460.0,) * 3, (5.201,) * 3),
        "problem_diagnose_clamped.toml": head(
            "Three-storey frame: clamped legs against what was measured", FRAME
        )
        + shared
        + frame_table(tests[0], "fit", names[0])
        + frame_table(tests[1], "hold-out", names[1])
        + frame_table(tests[2], "hold-out", names[2]),
        "problem_calibrate.toml": head(
            "Three-storey frame: storeys calibrated on the first test", FRAME
        )
        + shared
        + frame_table(tests[0], "fit", names[0])
        + STOREYS,
    }


def repeats(k: Sequence[float], m: Sequence[float]) -> dict[str, str]:
    """The second and the third test against the model calibrated on the first."""
    tests = frame_modes()
    return {"calibrated.toml": frame(k, m)} | {
        f"problem_diagnose_test_{i}.toml": head(
            f"Three-storey frame, test {i}, against the model calibrated on test 1", FRAME
        )
        + including("calibrated.toml")
        + frame_table(tests[i - 1], "fit", f"test_{i}.csv")
        + frame_table(tests[4 - i], "hold-out", f"test_{5 - i}.csv")
        for i in (2, 3)
    }


def main() -> int:
    """Write all files; what one step needs of an earlier `run` is run here."""
    from cvxupdate.study import run

    if table.data_root() is None:
        print(
            "CVXUPDATE_DATA does not name a folder: put the data sets there (README.md says "
            "where they are published).",
            file=sys.stderr,
        )
        return 2
    made = {
        "dropbear-moving-support": roller(),
        "unb-cantilever-tip-mass": tip_masses(),
        "beam-six-masses-frf": beam_files(),
        "cristallo-3storey-frame": frame_files(),
    }
    write(made)
    k1, k2, k3, m1, m3 = (
        q.after
        for q in run(
            table.PROBLEMS / "cristallo-3storey-frame" / "problem_calibrate.toml"
        ).parameters
    )
    write({"cristallo-3storey-frame": repeats((k1, k2, k3), (m1, 5.201, m3))})
    return 0


def write(made: Mapping[str, Mapping[str, str]]) -> None:
    """Problem files by data set and name."""
    for name, files in made.items():
        for file, text in files.items():
            text = text.rstrip("\n") + "\n"
            (table.PROBLEMS / name / file).write_text(text, encoding="utf-8")
            print(f"{name}/{file}")


if __name__ == "__main__":
    sys.exit(main())
