"""A classical solution of chapter 4 on the page of `run`: Picard plot and L-curve."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from cvxupdate.report.figures import WIDTH
from cvxupdate.report.numbers import count, number
from cvxupdate.report.svg import AFTER, BEFORE, HELD, QUIET, draw

if TYPE_CHECKING:
    from cvxupdate.update.result import ClassicalResult, Updated

NAMES = {
    "truncated-svd": ("Truncated singular value decomposition (4.11)", "term"),
    "total-least-squares": ("Total least squares (4.14–4.18)", "singular value"),
    "landweber": ("Landweber–Fridman iteration (2.9)", "iteration"),
    "conjugate-gradients": ("Conjugate gradients (2.9)", "iteration"),
    "tikhonov": ("Tikhonov regularisation (4.7)", ""),
    "entropy": ("Maximum entropy (4.23)", ""),
}
"""What each solution is called, and what its level counts."""


def method_words(updated: Updated) -> str:
    """The method, and what solved its equations."""
    if updated.classical is not None:
        return f"{updated.method}, equations solved by {updated.solver} (classical, not convex)"
    if updated.direct:
        return f"{updated.method}: a formula, evaluated once"
    return f"{updated.method}, convex steps solved by {updated.solver}"


def classical_parts(updated: Updated) -> dict[str, Any] | None:
    """The sentence and the two figures; None where the steps were convex."""
    c = updated.classical
    if c is None:
        return None
    return {"says": _says(c), "picard": Markup(_picard(c)), "curve": _curve(c)}


def _says(c: ClassicalResult) -> str:
    title, what = NAMES[c.solution]
    n = len(c.singular)
    if c.alpha is not None:
        return f"{title} with α = {number(c.alpha, 3)}: {c.chosen}."
    of = "" if what == "iteration" else f" of {n}"
    return f"{title} with {count(c.level or 0, what)}{of}: {c.chosen}."


def _picard(c: ClassicalResult) -> str:
    def paint(ax: Any) -> None:
        order = range(1, len(c.singular) + 1)
        ax.semilogy(order, c.singular, "-", color=BEFORE, label="singular value σ")
        k = c.picard_level
        ax.semilogy(list(order)[:k], c.coefficients[:k], "o", color=AFTER, ms=5, mew=0)
        ax.semilogy(
            order, c.coefficients, "o", mfc="none", mec=AFTER, mew=1.2, ms=5, label="|uᵀ b|"
        )
        if c.noise > 0.0:
            ax.axhline(2.0 * c.noise, color=QUIET, ls="--", label="twice the noise of b")
        ax.set(xlabel="term", ylabel="weighted (dimensionless)")
        ax.grid(False, which="minor")
        ax.xaxis.get_major_locator().set_params(integer=True)
        ax.legend(loc="lower left")

    return draw(
        "picard",
        "Singular values and coefficients of the right-hand side, term by term, with the noise",
        WIDTH,
        3.2,
        paint,
    )


def _curve(c: ClassicalResult) -> Markup | None:
    usable = [
        (r, s) for r, s in zip(c.curve_residual, c.curve_size, strict=True) if r > 0 and s > 0
    ]
    if len(usable) < 2:
        return None
    corner = (c.curve_residual[c.corner], c.curve_size[c.corner])

    def paint(ax: Any) -> None:
        ax.loglog([r for r, _ in usable], [s for _, s in usable], "-", color=AFTER)
        if min(corner) > 0:
            label = f"α = {number(c.curve_alpha[c.corner], 3)}"
            ax.loglog(*([v] for v in corner), "o", color=HELD, ms=7, mew=0, label=label)
            ax.legend(loc="upper right")
        ax.set(xlabel="‖A p − b‖ (weighted)", ylabel="‖p‖")
        ax.grid(False, which="minor")

    return Markup(draw("l-curve", "The L-curve with its corner", WIDTH, 3.2, paint))
