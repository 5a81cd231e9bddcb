"""Recordings of one structure against each other: gains that disagree, FRFs that change with the
level."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.recordings.lines import frf_peaks
from cvxupdate.recordings.quality.estimates import Estimate, estimates_of
from cvxupdate.recordings.quality.finding import ALPHA, Finding
from cvxupdate.recordings.quantiles import chi_square_above, normal_above, student_above
from cvxupdate.recordings.types import Complex, Real, Recording

_MAJORITY = 9
"""Recordings that elect the one that all are held against, at most: each is compared with each."""
_SHIFT = 0.05
"""Relative shift of resonances between two tests of one structure that is no fault of a channel:
weights lines on flanks down."""


def _log_ratio(broad: Estimate, frequency: Real, H: Complex, variance: Real) -> tuple[Real, Real]:
    """ln|H / H_broad| at the given frequencies and its variance, flanks weighted down; points that
    are mostly noise are left out."""
    inside = (frequency >= broad.frequency[1]) & (frequency <= broad.frequency[-2])
    frequency, H, variance = frequency[inside], H[inside], variance[inside]
    log = np.log(np.maximum(np.abs(broad.H), np.finfo(float).tiny))
    value = np.interp(frequency, broad.frequency, log)
    # what a shift of the resonances by 5 % would do to the logarithm: its range over that
    # neighbourhood
    around = np.stack(
        [
            np.interp(frequency * (1.0 + shift), broad.frequency, log)
            for shift in np.linspace(-_SHIFT, _SHIFT, 11)
        ]
    )
    moved = np.ptp(around, axis=0)
    noise = np.interp(frequency, broad.frequency, broad.noise)
    own = variance / np.maximum(np.abs(H) ** 2, np.finfo(float).tiny)
    total = 0.5 * (noise + own) + moved**2 + 1e-2
    keep = (noise < 0.1) & (own < 0.1)
    return (np.log(np.maximum(np.abs(H), np.finfo(float).tiny)) - value)[keep], total[keep]


def _weighted_median(x: Real, weight: Real) -> float:
    order = np.argsort(x)
    total = np.cumsum(weight[order])
    return float(x[order][int(np.searchsorted(total, 0.5 * total[-1]))])


def gain_of(
    pairs: Sequence[tuple[Estimate, Sequence[Estimate]]], alpha: float = ALPHA
) -> tuple[float, float, float, int]:
    """(ln gain of the others against the broad ones, statistic, threshold, points), pooled over
    structures.

    The weighted median of the logarithms, because one line near an unexpected antiresonance must
    not carry it; its deviation is 1.2533 times that of the weighted mean, scaled up by the scatter
    (weighted MAD) where that is larger than the weights say. Normal law where the weights hold,
    Student's t with the effective number of points less one where the scatter had to be used.
    """
    parts = [
        _log_ratio(broad, e.frequency, e.H, e.variance) for broad, others in pairs for e in others
    ]
    ratio, variance = (
        np.concatenate([p[i] for p in parts]) if parts else np.zeros(0) for i in (0, 1)
    )
    if ratio.size < 4:
        return 0.0, 0.0, np.inf, int(ratio.size)
    weight = 1.0 / variance
    middle = _weighted_median(ratio, weight)
    scatter = 1.4826 * _weighted_median(np.abs(ratio - middle) * np.sqrt(weight), weight)
    deviation = 1.2533 * max(scatter, 1.0) / float(np.sqrt(np.sum(weight)))
    effective = float(np.sum(weight) ** 2 / np.sum(weight**2))
    law = (
        normal_above(alpha / 2.0)
        if scatter <= 1.0
        else student_above(alpha / 2.0, max(effective - 1.0, 1.0))
    )
    return middle, abs(middle) / deviation, law, int(ratio.size)


def _sparse(e: Estimate, count: int = 24) -> Estimate:
    """Lines far enough apart to be independent, for a comparison of two broad estimates."""
    use = np.unique(
        np.linspace(1, len(e.frequency) - 2, min(count, max(len(e.frequency) // 8, 4))).astype(int)
    )
    return Estimate(
        e.origin, e.key, e.response, e.reference, e.frequency[use], e.H[use], e.variance[use]
    )


def _spacing(e: Estimate) -> float:
    """Hz, of most of its lines."""
    return float(np.median(np.diff(e.frequency)))


def _level(a: Estimate, b: Estimate, alpha: float) -> Finding | None:
    """Two broad FRFs of one pair of DOFs that differ by more than their variances, and not by one
    factor."""
    if _spacing(a) < _spacing(b):
        a, b = b, a
    low, high = max(a.frequency[0], b.frequency[0]), min(a.frequency[-1], b.frequency[-1])
    grid = a.frequency[(a.frequency >= low) & (a.frequency <= high)]
    if grid.size < 24:
        return None
    smeared = min(a.shared, b.shared) == 0
    if smeared and _spacing(a) > 2.0 * _spacing(b):
        return None  # other resolutions smear the peaks differently
    Ha = np.interp(grid, a.frequency, a.H.real) + 1j * np.interp(grid, a.frequency, a.H.imag)
    Hb = np.interp(grid, b.frequency, b.H.real) + 1j * np.interp(grid, b.frequency, b.H.imag)
    variance = np.interp(grid, a.frequency, a.variance) + np.interp(grid, b.frequency, b.variance)
    # strong, well measured lines only: there a change of the structure shows, and leakage of weak
    # lines does not
    sound = (np.interp(grid, a.frequency, a.noise) < 0.1) & (
        np.interp(grid, b.frequency, b.noise) < 0.1
    )
    if np.count_nonzero(sound) < 24:
        return None
    strong = sound & (np.abs(Ha) ** 2 > np.mean(np.abs(Ha[sound]) ** 2))
    if np.count_nonzero(strong) < 6:
        return None
    misfit = float(
        np.mean(np.abs(Ha - Hb)[strong] ** 2 / np.maximum(variance[strong], np.finfo(float).tiny))
    )
    # two degrees of freedom a line; half of the lines independent where they were averaged
    free = max(2.0 * np.count_nonzero(strong) / (max(a.shared, b.shared) or 2.0), 2.0)
    threshold = chi_square_above(alpha, free) / free
    relative = float(
        np.sqrt(np.sum(np.abs(Ha - Hb)[strong] ** 2) / np.sum(np.abs(Ha)[strong] ** 2))
    )
    if misfit <= threshold or relative < 0.1:
        return None
    peaks = [
        frf_peaks(grid, np.where(sound, H, 0.0)[:, None], 1, prominence_db=3.0) for H in (Ha, Hb)
    ]
    moved = ""
    if all(peaks):
        tops = [f"{found[0].frequency:.4g}" for found in peaks]
        if tops[0] != tops[1]:
            moved = f", its most prominent peak from {tops[0]} to {tops[1]} Hz"
    at = [x.origin.level for x in (a, b)]
    levels = f"{a.origin.name} to {b.origin.name}"
    if at[0] is not None and at[0] == at[1]:
        levels += f", both at level {at[0]:g}"
    elif None not in at:
        levels = f"level {at[0]:g} to {at[1]:g}"
    return Finding(
        "level dependence",
        f"{a.response.label}/{a.reference.label}",
        f"the FRF {a.response.label}/{a.reference.label} changes by {100 * relative:.0f} % "
        f"from {levels}{moved}: a non-linear structure, or one that was changed between the "
        "tests.",
        misfit,
        threshold,
        relative,
    )


def _best(broad: Sequence[Estimate]) -> Estimate:
    """What the others are held against: of three or more the one nearest to all others (a
    majority), of two the better measured one."""

    def distance(e: Estimate) -> float:
        return float(
            np.median(
                [abs(gain_of([(e, [_sparse(other)])])[0]) for other in broad if other is not e]
            )
        )

    if len(broad) > 2:
        broad = broad[:: -(-len(broad) // _MAJORITY)]  # of many, evenly chosen ones
        return min(broad, key=distance) if len(broad) > 2 else broad[0]
    return min(broad, key=lambda e: float(np.median(e.noise[e.frequency > 0.0])))


def compare(recordings: Sequence[Recording], alpha: float = ALPHA) -> tuple[Finding, ...]:
    """What recordings of one structure say about each other: gains out of line, and FRFs that
    change with the level.

    Gain: the logarithm of |H / H'| at common frequencies, lines on flanks weighted down by what a 5
    % shift of the resonances would do, tested by Student's t with the scatter found; all sine tests
    of a pair of DOFs stand together against the broad-band ones. A gain counts from 20 % on. False
    alarms: ``alpha`` for each pair of recordings and DOFs.
    """
    estimates = [e for r in recordings for e in estimates_of(r)]
    found: list[Finding] = []
    for key in dict.fromkeys(e.key for e in estimates):
        same = [e for e in estimates if e.key == key]
        broad, narrow = [e for e in same if not e.narrow], [e for e in same if e.narrow]
        if not broad:
            continue
        first = _best(broad)
        for e in broad:
            if e is first:
                continue
            mean, t, threshold, _ = gain_of([(first, [_sparse(e)])], alpha)
            if t > threshold and abs(mean) > np.log(1.2):
                found.append(_gain_finding([e], first, mean, t, threshold))
            else:
                level = _level(first, e, alpha)
                found += [level] if level is not None else []
        mirrored = [
            e
            for e in estimates
            if e.key == key[::-1] and key[0] < key[2] and not e.narrow and e.origin != first.origin
        ]
        for e in mirrored[:1]:
            mean, t, threshold, _ = gain_of([(first, [_sparse(e)])], alpha)
            if t > threshold and abs(mean) > np.log(1.2):
                pair = (
                    f"{first.response.label}/{first.reference.label} in {first.origin.name} and "
                    f"{e.response.label}/{e.reference.label} in {e.origin.name}"
                )
                found.append(
                    Finding(
                        "reciprocity",
                        pair,
                        f"{pair} should be equal; the second is {np.exp(mean):.2g} times the "
                        "first: a gain or a place is wrong, or one of them hardly moves where "
                        "the other drives, and a sensor beside its node makes as much.",
                        t,
                        threshold,
                        float(np.exp(mean)),
                    )
                )
        if narrow:
            mean, t, threshold, _ = gain_of([(first, narrow)], alpha)
            if t > threshold and abs(mean) > np.log(1.2):
                found.append(_gain_finding(narrow, first, mean, t, threshold))
    return tuple(found)


def compare_series(
    series: Sequence[Sequence[Recording]], alpha: float = ALPHA
) -> tuple[Finding, ...]:
    """The force channel of the sine tests against that of the broad-band tests, pooled over several
    structures (one sequence for each).

    What differs from structure to structure averages out, what the channel does stays: the gain is
    that of `compare`, with all points together.
    """
    groups = [[e for r in recordings for e in estimates_of(r)] for recordings in series]
    found = []
    for key in dict.fromkeys(e.key for group in groups for e in group):
        pairs = []
        for group in groups:
            broad = [e for e in group if e.key == key and not e.narrow]
            narrow = [e for e in group if e.key == key and e.narrow]
            if broad and narrow:
                pairs.append((_best(broad), narrow))
        mean, t, threshold, _ = gain_of(pairs, alpha)
        if len(pairs) > 1 and t > threshold and abs(mean) > np.log(1.2):
            found.append(
                _gain_finding(
                    [e for _, narrow in pairs for e in narrow], pairs[0][0], mean, t, threshold
                )
            )
    return tuple(found)


def _gain_finding(
    others: Sequence[Estimate], broad: Estimate, mean: float, t: float, threshold: float
) -> Finding:
    factor = float(np.exp(-mean))
    who = (
        others[0].origin.name
        if len(others) == 1
        else f"the {len(others)} sine tests ({others[0].origin.name} to {others[-1].origin.name})"
    )
    return Finding(
        "gain",
        f"{others[0].reference.label} (force)",
        f"in {who} the force at {others[0].reference.label} reads {factor:.2g} times what it "
        f"reads in {broad.origin.name} for the same response at {others[0].response.label}: a "
        "force channel (or that response) has the wrong scale. Test a known mass to see "
        "which.",
        t,
        threshold,
        factor,
    )
