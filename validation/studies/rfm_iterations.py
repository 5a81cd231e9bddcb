"""The iterations of the literature on the noise-free problems of chapter 3: additive (3.49),
multiplicative (3.50), each with a line search or second-order terms, none with bounds; beside the
convex loop with its trust region, alone and in the same forms. Is the multiplicative form more
stable and faster, as 3.5.6 says?

Where the equations have full rank the two forms take the same step: relative changes are the same
unknowns in other units. In the convex loop the multiplicative form is a trust region in shares of
the present factors; it is no faster either, and slower on the incomplete chain. What does pay are
second-order terms: a third fewer iterations on the bay, and on the chain together with a line
search (alone they follow its curved valley in short steps).

``python -m validation.studies rfm_iterations --every`` has the bay as well, a quarter of an hour.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.residual.frf import FrfResidual
from cvxupdate.study import open_problem
from cvxupdate.update.parts import loop_options, solver_choice, step_problem
from cvxupdate.update.rfm import prepare
from cvxupdate.update.rfm_loop import fit_responses
from validation.studies.bay_case import PROBLEMS
from validation.studies.classic_loop import classic_loop

FORMS = {
    "additive": {},
    "line search": {"line_search": True},
    "second order": {"second_order": True},
    "both": {"line_search": True, "second_order": True},
}
CONVEX = {
    "": {},
    ", multiplicative": {"relative": True},
    **{f", {words}": extra for words, extra in FORMS.items() if extra},
}

CHAIN, BAY = (
    ("chain10/complete", "chain10/incomplete"),
    ("bay/fe1_x1_complete", "bay/fe1_x1_incomplete"),
)
KINDS = ("force-balance", "flexibility", "receptance")


def options(spec, model, extra):
    """The problem's own options in another form; in the multiplicative one every p-value is a
    factor."""
    relative = (True,) * len(model.parameters) if "relative" in extra else ()
    return replace(loop_options(spec, model), **{**extra, "relative": relative})


def study(names=CHAIN + BAY, kinds=KINDS):
    """{problem: {variant: (iterations, converged, ‖p − p of the convex loop‖)}}."""
    out = {}
    for name in names:
        path = PROBLEMS / name / "problem.toml"
        spec, model, recordings = open_problem(path)
        data = prepare(spec, model, recordings).chosen
        found, truth = {}, None
        for words, extra in CONVEX.items():
            loop = fit_responses(
                model,
                data,
                step_problem(spec, model, recordings),
                solver_choice(spec),
                options(spec, model, extra),
            )
            truth = loop.point.p if truth is None else truth
            found[f"convex loop{words}"] = (
                len(loop.history),
                loop.status == "converged",
                float(np.linalg.norm(loop.point.p - truth)),
            )
        for kind in kinds:
            residual = FrfResidual(model, data, kind)
            for form in ("additive", "multiplicative"):
                for words, extra in FORMS.items():
                    r = classic_loop(
                        residual.evaluate,
                        model.zero(),
                        form,
                        tolerance=1e-6,
                        max_iterations=60,
                        **extra,
                    )
                    found[f"{kind}, {form}" + ("" if words == "additive" else f", {words}")] = (
                        r.iterations,
                        r.converged,
                        float(np.linalg.norm(r.p - truth)),
                    )
        out[name] = found
    return out


def main(folder, wish):
    """Print and draw how many iterations each form takes; gives the study."""
    import matplotlib.pyplot as plt

    if wish.quick:
        found = study(CHAIN[:1], KINDS[:1])
    else:
        found = study(CHAIN + BAY if wish.every else CHAIN)
    names, variants = list(found), list(next(iter(found.values())))
    print(
        f"{'iterations to a step below 1e-6 (— wrong or not at all)':60s}"
        + "".join(f"{n:>24s}" for n in names)
    )
    right = {n: [(i if ok and e < 1e-3 else None) for i, ok, e in found[n].values()] for n in names}
    for k, variant in enumerate(variants):
        print(
            f"{variant:60s}"
            + "".join(f"{right[n][k] if right[n][k] is not None else '—':>24}" for n in names)
        )
    figure, ax = plt.subplots(figsize=(7, 7))
    for j, n in enumerate(names):
        ax.barh(np.arange(len(variants)) + 0.2 * j, [v or 0 for v in right[n]], 0.2, label=n)
    ax.set_yticks(np.arange(len(variants)) + 0.3, variants, fontsize=7)
    ax.invert_yaxis()
    ax.set_xlabel("iterations (no bar: diverged)")
    ax.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(folder / "rfm_iterations.png", dpi=120)
    return found
