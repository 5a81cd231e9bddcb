"""`run`: a measured steel plate, updated with five parameters on 18 modes and scored on two that
the fit never saw.

Writes result.json, report.html and updated/problem.toml as `cvxupdate run` does, and a figure of
its own: the frequency error of every mode, before and after.

Run: python examples/update_a_plate.py [folder]
"""

import sys
from pathlib import Path

import cvxupdate

PROBLEM = Path(__file__).resolve().parents[1] / "problems" / "structure_a" / "problem.toml"


def table(updated):
    """Errors and parameters as text."""
    lines = []
    for use, name in (("fit", "fitted"), ("hold_out", "held out")):
        e = updated.fit[use]["frequency_error_percent_mean"]
        lines.append(f"mean frequency error, {name:8s}  {e['before']:.2f} % -> {e['after']:.2f} %")
    for q in updated.parameters:
        lines.append(
            f"{q.name:12s} {q.before:8.4g} -> {q.after:8.4f} ± {q.standard_deviation:.2g}   "
            f"({q.lower:g} ... {q.upper:g})"
        )
    return "\n".join(lines)


def figure(updated, path):
    """Signed frequency error of each mode, before and after."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    fig = Figure(figsize=(8, 3.6), layout="constrained")
    FigureCanvasAgg(fig)
    ax = fig.subplots()
    for use, marker, colour in (("fit", "o", "C0"), ("hold-out", "D", "C1")):
        modes = [m for m in updated.modes if m.use == use]
        f = [m.measured for m in modes]
        ax.plot(
            f,
            [100 * (m.before / m.measured - 1) for m in modes],
            marker,
            mfc="none",
            mec=colour,
            label=f"before, {use}",
        )
        ax.plot(
            f,
            [100 * (m.after / m.measured - 1) for m in modes],
            marker,
            color=colour,
            label=f"after, {use}",
        )
    ax.axhline(0, color="0.3", lw=0.8)
    ax.set(xlabel="measured frequency (Hz)", ylabel="(model − measured) / measured (%)")
    ax.legend(ncols=2)
    ax.grid(alpha=0.3)
    fig.savefig(path, dpi=150)
    return path


def main(folder="out/examples/update_a_plate"):
    """Update the plate, print what came of it, write report and figure."""
    out = Path(folder)
    updated = cvxupdate.run(PROBLEM)
    updated.save(out)
    print(table(updated))
    print(figure(updated, out / "errors.png"))
    return updated


if __name__ == "__main__":
    main(*sys.argv[1:2])
