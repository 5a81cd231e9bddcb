"""Arguments of the Python API: of the right form and nearly so."""

from __future__ import annotations

from typing import Any

import numpy as np

import cvxupdate

WORDS = ("x", "rz", "n1.x", "n99.q", "all", "", "beam2d", "spring", "mass", "steel", "é", "1")
KEYS = ("id", "nodes", "k", "m", "dof", "group", "type", "rows", "E", "kind", "bounds", "weight")


def anything(rng: np.random.Generator, depth: int = 0) -> Any:
    """A value of any kind that a program may pass by mistake."""
    way = int(rng.integers(12 if depth < 3 else 7))
    sizes = tuple(int(n) for n in rng.integers(0, 4, int(rng.integers(0, 4))))
    match way:
        case 0:
            return None
        case 1:
            return int(rng.integers(-3, 6))
        case 2:
            return float(rng.choice([0.0, -1.0, 1e308, -1e-320, np.nan, np.inf, 2.5]))
        case 3:
            return str(rng.choice(WORDS))
        case 4:
            return bool(rng.integers(2))
        case 5:
            return rng.normal(size=sizes) * 10.0 ** float(rng.integers(-5, 8))
        case 6:
            return rng.normal(size=sizes) + 1j * rng.normal(size=sizes)
        case 7 | 8:
            return [anything(rng, depth + 1) for _ in range(int(rng.integers(0, 4)))]
        case 9:
            return tuple(anything(rng, depth + 1) for _ in range(int(rng.integers(0, 3))))
        case _:
            return {
                str(rng.choice(KEYS)): anything(rng, depth + 1) for _ in range(rng.integers(0, 4))
            }


def _mostly(rng: np.random.Generator, good: Any) -> Any:
    return good if rng.random() < 0.7 else anything(rng)


def _model(rng: np.random.Generator) -> cvxupdate.Model:
    if rng.random() < 0.5:
        return cvxupdate.Model.from_matrices(
            _mostly(rng, [[3e5, -1e5], [-1e5, 1e5]]),
            _mostly(rng, [[2.0, 0.0], [0.0, 1.0]]),
            _mostly(rng, None),
            labels=_mostly(rng, None),
            groups=_mostly(rng, None),
        )
    return cvxupdate.Model(
        _mostly(rng, {1: [0.0], 2: [1.0]}),
        _mostly(
            rng,
            [
                {"type": "spring", "nodes": [[1, 2], [1, 1]], "dof": "x", "k": [4e5, 3e5]}
                if rng.random() < 0.3
                else {"type": "spring", "nodes": [[1, 2]], "dof": "x", "k": 3e5},
                {"type": "mass", "nodes": [[1], [2]], "m": [_mostly(rng, 6.5), 5.0]},
            ],
        ),
        supports=_mostly(rng, {1: "all"}),
        damping=_mostly(rng, None),
    )


def _frf(rng: np.random.Generator) -> cvxupdate.Frf:
    f = np.linspace(1.0, 60.0, 30)
    return cvxupdate.Frf(
        _mostly(rng, f),
        _mostly(rng, np.exp(1j * f)[:, None, None] * np.ones((30, 1, 1))),
        _mostly(rng, ["n2.x"]),
        _mostly(rng, ["n2.x"]),
        quantity="acceleration",
    )


def arguments_case(rng: np.random.Generator) -> None:
    """A model and recordings, some arguments wrong, put together and compared."""
    model = _model(rng)
    repr(model)
    way = int(rng.integers(4))
    if way == 0:
        recordings: Any = _frf(rng)
    elif way == 1:
        recordings = cvxupdate.Modes(_mostly(rng, [30.0]), damping=_mostly(rng, None))
    elif way == 2:
        recordings = cvxupdate.TimeHistory(
            _mostly(rng, np.zeros((64, 2)) + rng.normal(size=(64, 2))),
            _mostly(rng, 100.0),
            _mostly(rng, [("n2.x", "force"), ("n2.x", "acceleration")]),
        )
    else:
        recordings = anything(rng)
    if rng.random() < 0.5:
        cvxupdate.check(model, recordings)
    else:
        cvxupdate.correlate(model, recordings)
