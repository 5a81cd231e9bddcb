"""What the effects share that are parameters on a property of a set of elements."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial

from cvxupdate.fe.model import Model
from cvxupdate.physics.effect import Effect, EffectType, ModelChange, Quantity
from cvxupdate.physics.growth import Rates, Wanted, append_parameters, limited, tangents
from cvxupdate.physics.place import Place, at, capital
from cvxupdate.physics.quantity import factor
from cvxupdate.physics.units import number

Set = tuple[tuple[int, ...], tuple[str, ...]]  # element numbers, groups
Limits = tuple[float, float]


def on_sets(
    type_: EffectType,
    model: Model,
    sets: Iterable[Set],
    wanted: Callable[[int, tuple[int, ...]], Sequence[Wanted]],
    figures: Sequence[Quantity],
    *,
    limits: Limits,
    sign: int = 0,
    rates: Rates | None = None,
    additive: bool = False,
    cubic: bool = False,
    there: Place | None = None,
) -> list[Effect]:
    """An effect on each of ``sets`` (``there``: on that at a place alone): the model with the
    parameters ``wanted`` of it (number of the set, its elements); their tangent from ``rates``
    where the elements' are at hand."""
    out = []
    for k, (ids, groups) in enumerate(sets):
        if there is not None and ids != there.elements:
            continue
        asked = wanted(k, ids)
        grow = partial(append_parameters, model, asked)
        if rates is None:
            grown = grow()
            grow, tangent = partial(_itself, grown), tangents(grown, len(asked))
        else:
            tangent = (rates.tangent(ids),)
        change = ModelChange(grow, tangent, ids, additive, cubic=cubic)
        place = Place(elements=ids, groups=groups)
        out.append(Effect(type_, place, change, tuple(figures), sign, limits))
    return out


def factors(
    type_: EffectType,
    model: Model,
    of: str,
    sets: Iterable[Set],
    limits: Limits,
    cubic: bool = False,
    there: Place | None = None,
) -> list[Effect]:
    """A factor on the property ``of`` of each of ``sets`` (``there``: of that at a place alone)."""

    def wanted(k: int, ids: tuple[int, ...]) -> list[Wanted]:
        return [limited(f"{type_.name}@{k}", of, ids, limits)]

    return on_sets(
        type_,
        model,
        sets,
        wanted,
        [factor()],
        limits=limits,
        rates=Rates.of(model, of),
        additive=True,
        cubic=cubic,
        there=there,
    )


def percent(effect: Effect, values: Mapping[str, float], more: str, less: str) -> str:
    """ "In element 4 the real structure is 13 % softer than modelled." """
    change = 100.0 * (values["factor"] - 1.0)
    return (
        f"{capital(at(effect.place))} the real structure is {number(abs(change), 2)} % "
        f"{more if change > 0 else less} than modelled."
    )


def _itself(model: Model) -> Model:
    return model
