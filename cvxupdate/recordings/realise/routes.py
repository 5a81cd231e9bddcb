"""The ways from complex modes to normal ones by name, each with what it assumes and when it fails
(section 2.3.1)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.realise.shape import (
    ahmadian_gladwell,
    imregun_ewins,
    mac_with,
    niedbal,
    simple,
)
from cvxupdate.recordings.realise.starts import (
    Found,
    ModeSet,
    crossings,
    filled,
    normal_responses,
    resonance,
)
from cvxupdate.recordings.realise.state import ibrahim_state
from cvxupdate.recordings.realise.subspace import ibrahim_fullekrug, wei_zhang, zhang_lallement
from cvxupdate.recordings.types import Complex, Real


@dataclass(frozen=True)
class NormalModes:
    """Normal modes of one route.

    ``frequency`` (modes,) Hz, undamped; ``shapes`` (modes, channels) real, largest entry 1; ``mac``
    (modes,) with the complex shapes, NaN where the route found no such mode; ``route`` its name;
    ``says`` why there is none where it could not be done (then the arrays are NaN); the rest as in
    `Route`.
    """

    route: str
    frequency: Real
    shapes: Real
    mac: Real
    says: str = ""
    equations: str = ""
    assumes: str = ""
    fails: str = ""


@dataclass(frozen=True)
class Route:
    """One way: ``name`` on the command line, ``equations`` of the thesis, what it ``assumes``, when
    it ``fails``, and ``find(modes)`` that gives frequencies and shapes."""

    name: str
    equations: str
    assumes: str
    fails: str
    find: Callable[[ModeSet], Found]


def _by_shape(way: Callable[[Complex], Real]) -> Callable[[ModeSet], Found]:
    return lambda m: (m.frequency, way(m.shapes))


def _by_state(way: Callable[[Complex, Complex], Found]) -> Callable[[ModeSet], Found]:
    return lambda m: way(m.poles, m.shapes)


LIGHT = "damping so heavy, or modes so close, that phases are far from 0 and 180 degrees"
ROUTES: tuple[Route, ...] = (
    Route(
        "simple", "2.16", "light damping: phases near 0 or 180 degrees", LIGHT, _by_shape(simple)
    ),
    Route(
        "rotation",
        "after 2.34",
        "correlation with the complex shape is what counts (Ahmadian & Gladwell 1995)",
        "heavy damping that is not proportional: it undoes none of it",
        _by_shape(ahmadian_gladwell),
    ),
    Route(
        "mac",
        "after 2.34",
        "correlation with the complex shape is what counts (Imregun & Ewins 1993)",
        "as rotation, whose answer it reaches by steps",
        _by_shape(imregun_ewins),
    ),
    Route(
        "niedbal",
        "2.33, 2.34",
        "the measured modes span the real ones, and the real part of the transformation is near "
        "the unit matrix",
        "heavy damping; modes that couple with others outside the band",
        _by_shape(niedbal),
    ),
    Route(
        "ibrahim",
        "2.17 to 2.21",
        "viscous damping; as many channels as modes or more",
        "modes outside the band that couple through the damping; noisy shapes",
        _by_state(ibrahim_state),
    ),
    Route(
        "ibrahim-fill",
        "2.22, 2.23",
        "viscous damping; the model's modes that were not measured are right, and damping couples "
        "them hardly with the measured ones",
        "a model that is far off; heavy damping that couples modes within and outside the band",
        filled,
    ),
    Route(
        "zhang-lallement",
        "2.3.1",
        "viscous damping; complex modes are combinations of as many normal ones, in the span of "
        "their real parts",
        "heavy damping with few modes; noisy shapes",
        _by_state(zhang_lallement),
    ),
    Route(
        "wei-zhang",
        "2.3.1",
        "viscous damping; normal modes lie in the real subspace found by iteration",
        "heavy damping with few modes (Sestieri & Ibrahim 1993)",
        _by_state(wei_zhang),
    ),
    Route(
        "ibrahim-fullekrug",
        "2.3.1",
        "viscous damping; normal modes lie in the real subspace nearest to the complex ones",
        "heavy damping with few modes (Sestieri & Ibrahim 1993)",
        _by_state(ibrahim_fullekrug),
    ),
    Route(
        "normal-frf",
        "2.26 to 2.29",
        "forces and responses hold every degree of freedom that moves, or no more modes act in the "
        "band than there are forces",
        "fewer forces than modes that act at once: their poles are lost",
        normal_responses,
    ),
    Route(
        "resonance",
        "2.30 to 2.32",
        "responses and forces hold every degree of freedom that moves, or damping is light",
        "few forces and heavy damping: the smallest G that fits is taken",
        resonance,
    ),
    Route(
        "crossings",
        "2.24, 2.25",
        "forces at all responses, which hold every degree of freedom that moves",
        "fewer coordinates than modes in the band",
        crossings,
    ),
)
"""In the order of the thesis; one line makes a route known to the command line and its page."""


def route_named(name: str) -> Route:
    """The route of that name. Raises `RecordingError` when there is none."""
    for route in ROUTES:
        if route.name == name:
            return route
    raise RecordingError(
        f"there is no route to normal modes called {name!r}; known: "
        f"{', '.join(r.name for r in ROUTES)}, or all"
    )


def realised(modes: ModeSet, route: Route) -> NormalModes:
    """The normal modes of a set by one route, one for each complex mode: pairs have the largest
    MACs in sum. Where it cannot be done the result says why."""
    count, channels = modes.shapes.shape
    nothing = np.full(count, np.nan)
    about = (route.equations, route.assumes, route.fails)
    if not count:
        return NormalModes(
            route.name, nothing, np.zeros((0, channels)), nothing, "no modes", *about
        )
    try:
        frequency, shapes = route.find(modes)
    except (RecordingError, np.linalg.LinAlgError) as error:
        return NormalModes(
            route.name, nothing, np.full((count, channels), np.nan), nothing, str(error), *about
        )
    likeness = np.array([[_mac(c, r) for r in shapes] for c in modes.shapes]).reshape(count, -1)
    rows, columns = linear_sum_assignment(-likeness)
    f, out, mac = nothing.copy(), np.full((count, channels), np.nan), nothing.copy()
    for i, j in zip(rows, columns, strict=True):
        top = shapes[j][np.nanargmax(np.abs(shapes[j]))]
        f[i], out[i], mac[i] = frequency[j], shapes[j] / top, likeness[i, j]
    return NormalModes(route.name, f, out, mac, "", *about)


def _mac(c: Complex, r: Real) -> float:
    known = np.isfinite(r)
    return mac_with(c[known], r[known])
