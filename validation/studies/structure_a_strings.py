"""Structure A: where do the two strings hold the plate? The thesis does not say, so the places are
tried one by one.

Each is a problem file of its own, run through the public functions: five parameters (four without
strings), 18 modes fitted, 2 held out.
"""

import tempfile
from pathlib import Path

import cvxupdate
from validation.studies.structure_a_mesh import node_at, write_problem

NX, NY = 28, 20
QUICK = ("no strings", "middle of the short edges", "four corners")


def places(nx=NX, ny=NY):
    """Nodes held by strings, by what the place is called."""
    mid_y, mid_x = ny // 2, nx // 2
    return {
        "no strings": [],
        "middle of the short edges": [node_at(0, mid_y, nx), node_at(nx, mid_y, nx)],
        "middle of the long edges": [node_at(mid_x, 0, nx), node_at(mid_x, ny, nx)],
        "two corners of a short edge": [node_at(0, 0, nx), node_at(0, ny, nx)],
        "two corners of a long edge": [node_at(0, 0, nx), node_at(nx, 0, nx)],
        "two opposite corners": [node_at(0, 0, nx), node_at(nx, ny, nx)],
        "four corners": [node_at(i, j, nx) for i in (0, nx) for j in (0, ny)],
        "every node": [node_at(i, j, nx) for i in range(nx + 1) for j in range(ny + 1)],
    }


def study(nx=NX, ny=NY, names=None):
    """A result for each place (those of ``names`` only) on a mesh of nx x ny elements."""
    chosen = {name: held for name, held in places(nx, ny).items() if names is None or name in names}
    with tempfile.TemporaryDirectory() as folder:
        return {
            name: cvxupdate.run(
                write_problem(
                    Path(folder) / str(k), nx, ny, held, min(1.0, 2.0 / max(len(held), 1))
                )
            )
            for k, (name, held) in enumerate(chosen.items())
        }


def table(results, nx=NX, ny=NY):
    """The comparison as text, best first."""
    lines = [
        "place of the strings          mean error %   largest %   held out %   stiffness in all N/m"
    ]
    held = {name: len(nodes) for name, nodes in places(nx, ny).items()}
    for name, u in sorted(
        results.items(),
        key=lambda item: item[1].fit["fit"]["frequency_error_percent_mean"]["after"],
    ):
        mean, most = (
            u.fit["fit"][f"frequency_error_percent_{which}"]["after"] for which in ("mean", "max")
        )
        out = u.fit["hold_out"]["frequency_error_percent_mean"]["after"]
        k = next(
            (
                f"{held[name] * q.after:.0f} ± {held[name] * q.standard_deviation:.0f}"
                for q in u.parameters
                if q.of == "k"
            ),
            "-",
        )
        lines.append(f"{name:28s}  {mean:12.2f}  {most:10.2f}  {out:11.2f}  {k:>21s}")
    return "\n".join(lines)


def figure(results, path):
    """The frequency error of each mode for every place."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    fig = Figure(figsize=(8, 4), layout="constrained")
    FigureCanvasAgg(fig)
    ax = fig.subplots()
    for k, (name, u) in enumerate(results.items()):
        style = (
            {"marker": "o", "lw": 1.6}
            if name == "middle of the short edges"
            else {"marker": ".", "lw": 0.9, "ls": ":"}
        )
        ax.plot(
            [m.measured for m in u.modes],
            [100 * (m.after / m.measured - 1) for m in u.modes],
            ms=5,
            label=name,
            color=f"C{k}",
            **style,
        )
    ax.axhline(0, color="0.3", lw=0.8)
    ax.set(xlabel="measured frequency (Hz)", ylabel="(model − measured) / measured (%)")
    ax.legend(fontsize=8)
    ax.grid(alpha=0.3)
    fig.savefig(path, dpi=150)
    return path


def main(out, wish):
    """Try every place, print the table, write table and figure; gives the results."""
    mesh = (14, 10) if wish.quick else (NX, NY)
    results = study(*mesh, QUICK if wish.quick else None)
    text = table(results, *mesh)
    (out / "table.txt").write_text(text + "\n", encoding="utf-8")
    print(text)
    print(figure(results, out / "strings.png"))
    return results
