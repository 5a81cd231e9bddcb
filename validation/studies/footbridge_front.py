"""How near the footbridge's frequencies can come while its shapes stay: the front of mean MAC
against mean frequency error (problems/real/smu-modal-data).

Every mode counts alike: frequencies in units of 0.3 %, shapes by (1 − √MAC)/√MAC with a weight that
rises from row to row. `published`: the 17 stiffness factors within the published bounds. `wide`:
the same with bounds that leave hardly anything out, steel by a half and the slabs from 5 % to
twice. Of each weight the best of the nominal and of three random starts.

``python -m validation.studies footbridge_front``; ``--draws 10`` takes so many random starts.
"""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np

from cvxupdate.study import open_problem
from cvxupdate.update.measured_modes import modal_metrics
from cvxupdate.update.modal_fit import modal_fit
from cvxupdate.update.trust_region import objective_at
from validation.studies.modal_starts import FOLDER

WEIGHTS = (10.0, 30.0, 100.0, 300.0, 1000.0)
UNIT, ENTRY = 0.003, 0.1  # deviations: of a frequency, relative; of each entry of a shape
WIDE = {"Frame": (-0.5, 0.5), "Truss": (-0.5, 0.5), "Conc": (-0.95, 1.0)}
ON_BOUND = 1e-4


def fit_of(wide):
    """(the file's fit with equal weights of the modes, within its bounds or wide ones; the nominal
    model, paired as the file pairs)."""
    spec, model, recordings = open_problem(FOLDER / "problem_footbridge.toml")
    if wide:
        parameters = []
        for q in model.parameters:
            kind = next((k for k in WIDE if (q.group or "").startswith(k)), None)
            lower, upper = WIDE.get(kind, (q.lower, q.upper))
            parameters.append(replace(q, lower=lower, upper=upper))
        model = replace(model, parameters=tuple(parameters))
    fit = modal_fit(spec, model, recordings)
    nominal = fit.residual.evaluate(model.zero())
    table = fit.residual.fit[0]
    table = replace(
        table,
        frequency_std=UNIT * table.frequency,
        shape_std=np.where(table.shapes == 1.0, 0.0, ENTRY),
    )
    return replace(fit, residual=replace(fit.residual, fit=(table,))), nominal


def best(fit, weight, starts):
    """The point of the lowest objective with one weight of the shapes."""
    fit = replace(fit, residual=replace(fit.residual, shape_weight=weight))
    loops = [fit.run(p)[0] for p in starts]
    return min(loops, key=lambda loop: objective_at(loop.problem, loop.point)).point


def row(nominal, point):
    """(mean frequency error in %, mean MAC, least MAC, parameters on bounds) of a point."""
    found = modal_metrics(nominal, point)["fit"]
    lower, upper = limits(point.residual.model)
    slack = ON_BOUND * (upper - lower)
    held = np.sum((point.p <= lower + slack) | (point.p >= upper - slack))
    error, mean, least = (
        found[key]["after"] for key in ("frequency_error_percent_mean", "mac_mean", "mac_min")
    )
    return error, mean, least, int(held)


def limits(model):
    """Bounds of the parameters."""
    return tuple(np.array([getattr(q, k) for q in model.parameters]) for k in ("lower", "upper"))


def front(wide, weights, draws):
    """{weight: row}, the nominal model as weight None."""
    fit, nominal = fit_of(wide)
    model = fit.residual.model
    lower, upper = (np.clip(x, -0.3, 0.5) for x in limits(model))  # far springs hold nothing
    drawn = np.random.default_rng(1).uniform(lower, upper, (draws, len(lower)))
    out = {None: row(nominal, nominal)}
    for weight in weights:
        out[weight] = row(nominal, best(fit, weight, [model.zero(), *drawn]))
    return out


def main(folder, wish):
    """Print and draw both fronts; gives {set: {weight: row}}."""
    import matplotlib.pyplot as plt

    draws = 0 if wish.quick else 3 if wish.draws is None else wish.draws
    found = {}
    figure, ax = plt.subplots(figsize=(7, 4))
    lines = [("bounds", "weight", "frequency error %", "MAC mean", "MAC least", "on bounds")]
    for name in ("published", "wide"):
        found[name] = front(name == "wide", WEIGHTS[2:3] if wish.quick else WEIGHTS, draws)
        for weight, (error, mean, least, held) in found[name].items():
            at = "nominal" if weight is None else f"weight {weight:g}"
            print(
                f"{name:10s} {at:12s} {error:6.3f} % off, MAC {mean:.4f} (least {least:.3f}), "
                f"{held} of 17 on bounds",
                flush=True,
            )
            lines.append((name, at, error, mean, least, held))
        points = list(found[name].values())
        ax.plot([p[0] for p in points], [p[1] for p in points], "o", label=name)
    ax.plot([0.0, 0.3, 0.3], [0.955, 0.955, 1.0], "k:", label="asked")
    ax.set(xlabel="mean frequency error (%)", ylabel="mean MAC", ylim=(0.92, 0.97))
    ax.legend()
    figure.tight_layout()
    figure.savefig(folder / "footbridge_front.png", dpi=130)
    with (folder / "footbridge_front.csv").open("w", newline="") as file:
        csv.writer(file).writerows(lines)
    return found
