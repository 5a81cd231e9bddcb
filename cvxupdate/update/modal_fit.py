"""What the modal methods fit, from a problem file: one object that runs from any start."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.convex import SolverChoice, StepProblem
from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.continued import EXACT
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import ModeTable, Recording
from cvxupdate.residual.modal import ModalPoint, ModalResidual, modal_residual
from cvxupdate.residual.shape_rows import Index
from cvxupdate.spec import Spec
from cvxupdate.system import Array
from cvxupdate.update.ahead import Ahead
from cvxupdate.update.classical import Asked, asked_of, fit_classical
from cvxupdate.update.measured_modes import modal_tables
from cvxupdate.update.minimum_variance import minimum_variance
from cvxupdate.update.modal_loop import (
    LOWER,
    MET,
    PATIENCE,
    begun_again,
    released,
    shapes_first,
    with_pairing,
)
from cvxupdate.update.outcome import outside
from cvxupdate.update.parts import loop_options, solver_choice, step_problem
from cvxupdate.update.starts import StartEnd, timed
from cvxupdate.update.trust_region import Iteration, LoopResult, Options, objective_at


def residual_of(spec: Spec, model: Model, recordings: Sequence[Recording]) -> ModalResidual:
    """The modal comparison that the [update] table asks for."""
    if spec.update is None:
        raise InputError(
            f"{spec.path}: there is no [update] table. Add one with a method and parameters."
        )
    return comparison(spec, model, *modal_tables(recordings))


def comparison(
    spec: Spec,
    model: Model,
    fit: Sequence[ModeTable],
    hold_out: Sequence[ModeTable],
    given: Sequence[Index] | None = None,
) -> ModalResidual:
    """The same of these tables; ``given`` are places of the fitted ones that are known."""
    u = spec.update
    if u is None:
        plain = modal_residual(model, fit, hold_out, False, "auto", given)
        return replace(plain, correlated=True)
    shapes = u.method in ("sensitivity", "minimum-variance")
    rule = "auto" if u.pairing == "misfit" else u.pairing
    return replace(
        modal_residual(model, fit, hold_out, shapes, rule, given),
        form=u.shape_residual,
        shape_weight=u.shape_weight,
        repaired=u.pairing == "misfit",
        correlated=True,
    )


@dataclass(frozen=True)
class ModalFit:
    """Everything that one fit from a start needs, what is only scored left out; ``estimates`` of
    method minimum-variance alone, ``asked`` of a classical solution."""

    residual: ModalResidual
    problem: StepProblem
    choice: SolverChoice
    options: Options
    shapes_first: bool
    release: bool = False
    estimates: str | None = None
    asked: Asked | None = None

    def run(
        self, p0: Array, progress: Callable[[Iteration], None] | None = None
    ) -> tuple[LoopResult[ModalPoint], tuple[str, ...]]:
        """The loop from ``p0`` (n,), with notes."""
        if self.asked is not None:
            loop = fit_classical(
                lambda _: self.residual, self.problem, self.asked, self.options, p0, progress
            )
            return loop, outside(self.residual.model, loop)
        if self.estimates is not None:
            return minimum_variance(
                self.residual,
                self.problem,
                self.choice,
                self.options,
                p0,
                self.estimates == "correlated",
                progress,
            )
        first = shapes_first if self.shapes_first else with_pairing
        options = self.options
        if self.residual.reducible:
            options = replace(options, met=MET, still=EXACT, ahead=Ahead(options.radius))

        def begun(
            p: Array, patience: int | None = None
        ) -> tuple[LoopResult[ModalPoint], tuple[str, ...]]:
            own = replace(_afresh(options), patience=patience)
            return first(self.residual, self.problem, self.choice, own, p, progress)

        if not self.release:
            return begun(p0)
        loop, notes = begun(p0, PATIENCE)
        crawled = loop.status == "stopped" and len(loop.history) < options.max_iterations
        if crawled:
            loop, notes = begun_again(begun, loop) or begun(p0)
        parameters = self.residual.model.parameters

        def again(
            p: Array, end: LoopResult[ModalPoint]
        ) -> tuple[LoopResult[ModalPoint], tuple[str, ...]]:
            below = objective_at(end.problem, end.point) * (1.0 - LOWER)
            known = tuple(end.point.p.tolist())
            back = replace(_afresh(options), known=known, below=below)
            return with_pairing(self.residual, end.problem, self.choice, back, p, progress)

        best, more = released(
            again,
            loop,
            np.array([q.lower for q in parameters]),
            np.array([q.upper for q in parameters]),
        )
        return best, (*notes, *more)

    def solve(self, number: int, p0: Array) -> StartEnd:
        """The end of one start; of one where the model is no structure, an infinite objective."""

        def ended(p: Array) -> tuple[float, Array, str, int]:
            try:
                loop, _ = self.run(p)
            except ModelError as error:
                return np.inf, p, f"failed: {error}", 0
            return (
                objective_at(loop.problem, loop.point),
                loop.point.p,
                loop.status,
                len(loop.history),
            )

        return timed(number, p0, ended)

    def objective(self, p: Array) -> float:
        """The objective at ``p``, inf where the model is no structure."""
        try:
            return objective_at(self.problem, self.residual.evaluate(p))
        except ModelError:
            return np.inf


def _afresh(options: Options) -> Options:
    """For another way: what was learnt on one is of no use on the next."""
    return options if options.ahead is None else replace(options, ahead=Ahead(options.radius))


def modal_fit(spec: Spec, model: Model, recordings: Sequence[Recording]) -> ModalFit:
    """What [update] asks for.

    Raises
    ------
    InputError, ModelError, RecordingError
        What the problem names cannot be used.
    """
    u = spec.update
    if u is None:
        raise InputError(
            f"{spec.path}: there is no [update] table. Add one with a method and parameters."
        )
    fit, _ = modal_tables(recordings)
    _check_covariances(spec, fit)
    residual = replace(comparison(spec, model, fit, ()), continued=True)
    if u.begin_with == "low":
        raise InputError(
            f'{spec.path}: update.begin_with = "low" grows the band of frequency responses, but '
            f'method is "{u.method}". Take method "rfm", or leave it out.'
        )
    first = u.begin_with == "shapes"
    if first and not (residual.shapes and any(t.shapes is not None for t in fit)):
        raise InputError(
            f'{spec.path}: update.begin_with = "shapes", but no shape is fitted. Use method '
            '"sensitivity" with a table of shapes, or leave it out.'
        )
    varied = u.method == "minimum-variance"
    unfit = {
        "begin_with": first,
        "release_bounds": u.release_bounds,
        "starts": bool(u.starts),
        'pairing = "misfit"': u.pairing == "misfit",
    }
    if varied and any(unfit.values()):
        named = ", ".join(name for name, asked in unfit.items() if asked)
        raise InputError(
            f"{spec.path}: update.{named} does not go with minimum-variance, whose covariances are "
            "those of one way from the nominal model. Leave it out."
        )
    problem = step_problem(spec, model, recordings)
    asked = asked_of(spec, problem)
    return ModalFit(
        residual,
        problem,
        solver_choice(spec),
        loop_options(spec, model),
        first,
        u.release_bounds,
        u.estimates if varied else None,
        asked,
    )


def _check_covariances(spec: Spec, fit: Sequence[ModeTable]) -> None:
    """Refuses what covariances of tables do not go with."""
    u, given = spec.update, [t for t in fit if t.covariance is not None]
    if u is None or not given:
        return
    if u.pairing == "misfit":
        raise InputError(
            f'{spec.path}: update.pairing = "misfit" weighs modes one by one, but '
            f"{given[0].origin.source} has a covariance that correlates them. Take another "
            "pairing, or deviations."
        )
    shaped = [t for t in given if len(np.asarray(t.covariance)) > len(t.frequency)]
    if shaped and u.method != "frequencies" and u.shape_residual == "mac":
        raise InputError(
            f'{spec.path}: update.shape_residual = "mac" is greatest where shapes agree, so to '
            "first order their errors do not move it, and the covariance of "
            f"{shaped[0].origin.source} gives it no weight. Take "
            '"scale" or "difference", or a covariance of the frequencies alone.'
        )
