"""Figures 6.1 to 6.8 and 6.11 of the thesis and the CEAM column of Table 6.2, from the problem
files problems/ceam/case1 … case6.
"""

from pathlib import Path

import numpy as np

from cvxupdate import study
from cvxupdate.correlate.response_error import modelled
from cvxupdate.recordings.measured import measured_responses

PROBLEMS = Path(__file__).resolve().parents[2] / "problems"
FIGURES = {
    1: ("Figure 6.1", "Figure 6.2"),
    2: ("Figure 6.3", ""),
    3: ("Figure 6.4", "Figure 6.5"),
    4: ("Figure 6.12", "Figure 6.6"),
    5: ("Figure 6.7", "Figure 6.8"),
    6: ("", "Figure 6.11"),
}


def case(number, name="problem.toml"):
    """(updated, model, held-out FRF, p) of a case."""
    path = PROBLEMS / f"ceam/case{number}" / name
    updated = study.run(path)
    _, model, recordings = study.open_problem(path)
    held = next(r for r in recordings if r.origin.use == "hold-out")
    return updated, model, held, np.array([q.p for q in updated.parameters])


def draw(number, found, folder, counts):
    """p-values beside the element numbers, and accelerances at n1.z of target, initial and updated
    model; of case 4 also those with ``counts`` of assigned modes (Figure 6.6)."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    updated, model, held, p = found
    figure, (bars, curves) = plt.subplots(2, 1, figsize=(8.5, 6.5), layout="constrained")
    kinds = [
        of for of in ("stiffness", "mass", "damping") if any(q.of == of for q in updated.parameters)
    ]
    for k, of in enumerate(kinds):
        values = [q.p for q in updated.parameters if q.of == of]
        label = of if np.abs(values).max() > 1e-6 else f"{of} (all below 1e-6)"
        bars.bar(np.arange(1, 21) + 0.27 * (k - (len(kinds) - 1) / 2), values, 0.25, label=label)
    bars.set(
        xlabel="element",
        ylabel="p",
        xticks=np.arange(1, 21),
        title=f"Case {number}: {FIGURES[number][0] or 'p-values (not printed)'}",
    )
    bars.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    i, j = (
        next(k for k, c in enumerate(channels) if c.label == "n1.z")
        for channels in (held.responses, held.references)
    )
    (measured,) = measured_responses(held)

    def of(which, p):
        return modelled(which, measured, p)

    shown = [
        ("target", measured.Y, "k-"),
        ("initial", of(model, model.zero()), "C1:"),
    ]
    if number == 4:  # Figure 6.6: the effect of the number of assigned modes
        shown += [
            (
                f"updated, {count} modes",
                of(model, case(4, f"modes{count}.toml")[3]),
                style,
            )
            for count, style in zip(counts, ("C2-.", "C3-.", "C4-."), strict=False)
        ]
    if "first_stage" in updated.model:  # Figure 6.11: two updated responses
        shown.append(
            (
                "after stage 1",
                of(model, np.array(updated.model["first_stage"])),
                "C2-.",
            )
        )
    shown.append(("updated, 20 modes" if number == 4 else "updated", of(model, p), "C0--"))
    for label, H, style in shown:
        curves.semilogy(held.frequency, np.abs(H[:, i, j]), style, label=label)
    curves.set(
        xlabel="frequency [Hz]",
        ylabel="accelerance n1.z [m/(s² N)]",
        title=FIGURES[number][1] or "Accelerance (not printed)",
    )
    curves.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.savefig(folder / f"ceam_case{number}.png", dpi=110)
    plt.close(figure)


def main(folder, wish):
    """Run the six cases; returns the rows (case, status, iterations, seconds, FRF error before and
    after)."""
    rows = []
    for number in (4,) if wish.quick else range(1, 7):
        found = case(number)
        draw(number, found, folder, (40,) if wish.quick else (40, 60, 80))
        u, error = found[0], found[0].fit["hold_out"]["frf_error"]
        rows.append((number, u.status, u.iterations, u.time, error["before"], error["after"]))
    first = rows[0][3]
    print("case  status      iterations  time/case 1  FRF error before  after")
    for number, status, iterations, seconds, before, after in rows:
        print(
            f"{number:4d}  {status:10s}  {iterations:10d}  {seconds / first:11.2f}  "
            f"{before:16.3g}  {after:.3g}"
        )
    return rows
