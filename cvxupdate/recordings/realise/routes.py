"""The ways from complex modes to normal ones by name, each with what it assumes and when it fails
(section 2.3.1)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.convert import convert
from cvxupdate.recordings.identify.result import IdentifiedModes
from cvxupdate.recordings.identify.synthesis import synthesise
from cvxupdate.recordings.realise.frf import chen_hsu_tsuei, resonance_shapes
from cvxupdate.recordings.realise.shape import (
    ahmadian_gladwell,
    imregun_ewins,
    mac_with,
    niedbal,
    simple,
)
from cvxupdate.recordings.realise.state import ibrahim_state
from cvxupdate.recordings.realise.subspace import ibrahim_fullekrug, wei_zhang, zhang_lallement
from cvxupdate.recordings.types import Complex, Real

Found = tuple[Real, Real]
BESIDE = 0.01
"""Distance from resonance, in fractions of critical damping, at which (2.32) is evaluated: near
enough for the mode to rule, and Re H can be inverted."""


@dataclass(frozen=True)
class ModeSet:
    """What a route starts from: ``poles`` (modes,) rad/s, ``shapes`` (modes, channels) complex;
    ``fitted`` the identification of FRFs that they come from, None for responses alone."""

    poles: Complex
    shapes: Complex
    fitted: IdentifiedModes | None = None

    @property
    def frequency(self) -> Real:
        """Natural frequencies |p| / 2π, Hz."""
        return np.asarray(np.abs(self.poles) / (2.0 * np.pi))


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


def _fitted(m: ModeSet, name: str) -> IdentifiedModes:
    if m.fitted is None:
        raise RecordingError(
            f"the route {name} needs frequency responses, and these modes come from responses "
            "alone; take a route through the modes, e.g. ibrahim-fullekrug"
        )
    return m.fitted


def _square(modes: IdentifiedModes, name: str) -> tuple[list[int], list[int]]:
    """Rows and columns of the FRFs at the places that are both responses and references."""
    at = {c.label: k for k, c in enumerate(modes.responses)}
    columns = [k for k, c in enumerate(modes.references) if c.label in at]
    if len(columns) < 2:
        raise RecordingError(
            f"the route {name} needs a square matrix of FRFs: at least two places that are both "
            f"driven and measured, there {'is 1' if columns else 'are 0'}"
        )
    return [at[modes.references[k].label] for k in columns], columns


def _resonance(m: ModeSet) -> Found:
    """(2.32) on the receptances synthesised beside the natural frequencies; the force is the one
    that moves the mode most. At the frequency itself Re H of the mode vanishes, and G with it."""
    modes = _fitted(m, "resonance")
    f = m.frequency * (1.0 + BESIDE * np.maximum(-m.poles.real / np.abs(m.poles), 1e-6))
    H = convert(synthesise(modes, f, quantity="displacement"), "displacement").H
    own = np.argmin(np.abs(modes.poles - m.poles[:, None]), axis=1)
    force = ahmadian_gladwell(modes.participation[own])
    force = force / np.linalg.norm(force, axis=1, keepdims=True)
    return m.frequency, resonance_shapes(H, np.einsum("foi,fi->fo", H, force))


def _crossings(m: ModeSet) -> Found:
    """`chen_hsu_tsuei` on the square part, densely synthesised over the band."""
    modes = _fitted(m, "crossings")
    rows, columns = _square(modes, "crossings")
    f = np.unique(
        np.concatenate(
            [
                np.linspace(*modes.band, 2000),
                *(g * (1.0 + 0.02 * np.linspace(-1, 1, 201)) for g in m.frequency),
            ]
        )
    )
    f = f[(f > 0.0) & (f >= modes.band[0]) & (f <= modes.band[1])]
    H = synthesise(modes, f, quantity="displacement").H[:, rows][:, :, columns]
    frequency, part = chen_hsu_tsuei(f, H)
    shapes = np.full((frequency.size, m.shapes.shape[1]), np.nan)
    shapes[:, rows] = part
    return frequency, shapes


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
        "resonance",
        "2.30 to 2.32",
        "responses and forces hold every degree of freedom that moves, or damping is light",
        "few forces and heavy damping: the smallest G that fits is taken",
        _resonance,
    ),
    Route(
        "crossings",
        "2.24 to 2.29",
        "forces at all responses, which hold every degree of freedom that moves",
        "fewer coordinates than modes in the band",
        _crossings,
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
