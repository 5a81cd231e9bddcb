"""`new`: a folder that runs, to be changed into one's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cvxupdate.commands.new_kinds import KINDS
from cvxupdate.commands.new_parts import Made, Table
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model

Real = NDArray[np.float64]
SEED = 20
FREQUENCY_NOISE, SHAPE_NOISE, RESPONSE_NOISE = 0.0005, 0.003, 0.002
"""Standard deviations of what is made up: of a frequency, a part of it; of an entry of a shape, a
part of the largest; of a response, a part of its r.m.s."""
ZETA = 0.01
LINES = 400


def new(kind: str, folder: Path) -> tuple[str, ...]:
    """Write a problem of a ``kind`` into ``folder``: problem.toml, the tables it names, and
    recordings that were computed from the same model with one thing changed. Gives the names of
    the files.

    Raises
    ------
    InputError
        For an unknown kind, a folder that holds something already, or one that cannot be written.
    """
    if kind not in KINDS:
        raise InputError(f"new: there is no {kind!r}. Give one of {', '.join(KINDS)}.")
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise InputError(
                f"{folder}: there is something already, and nothing is overwritten. Give a folder "
                "that is empty or not there yet."
            )
        made = KINDS[kind]()
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in made.files.items():
            (folder / name).write_text(text, encoding="utf-8")
        names = [*made.files, *_recorded(made, folder)]
    except OSError as error:
        raise InputError(
            f"{folder}: cannot be written ({error.strerror or error}). Give another folder."
        ) from error
    return tuple(names)


def _recorded(made: Made, folder: Path) -> list[str]:
    """The matrices that the problem names, and its recordings."""
    from cvxupdate.fe.build import build_model
    from cvxupdate.spec import spec_of

    truth = build_model(spec_of({"model": made.truth}))
    if made.matrices is None:
        (folder / "modes.csv").write_text(_modes(truth, made), encoding="utf-8")
        return ["modes.csv"]
    from scipy.io import mmwrite
    from scipy.sparse import coo_array

    names = []
    for name, matrix in made.matrices.items():
        mmwrite(folder / name, coo_array(matrix), symmetry="symmetric")
        names.append(name)
    _responses(truth, made, folder / "frf.npz")
    return [*names, "frf.npz"]


def _modes(truth: Model, made: Made) -> str:
    """A table of modes, one column for each sensor."""
    from cvxupdate.fe.modes import model_modes

    found = model_modes(truth, made.modes).flexible()
    random = np.random.default_rng(SEED)
    f = found.frequencies[: made.modes]
    rows = found.shapes[[truth.place[s] for s in made.sensors], : made.modes]
    rows = rows / rows[np.argmax(np.abs(rows), axis=0), np.arange(made.modes)]
    f = f * (1.0 + FREQUENCY_NOISE * random.standard_normal(f.shape))
    rows = rows + SHAPE_NOISE * random.standard_normal(rows.shape)
    table = Table(("mode", "frequency_Hz", "damping_pct", *(_column(s) for s in made.sensors)))
    for k in range(made.modes):
        table.add(k + 1, f"{f[k]:.4f}", f"{100 * ZETA:g}", *(f"{v:.4f}" for v in rows[:, k]))
    return table.text()


def _column(label: str) -> str:
    """``n4.y`` as the column ``4:+Y``."""
    node, _, dof = label[1:].partition(".")
    return f"{node}:+{dof.upper()}"


def _responses(truth: Model, made: Made, path: Path) -> None:
    """Accelerances of every sensor to a force at the last one, with their variance."""
    from cvxupdate.fe.modes import model_modes
    from cvxupdate.fe.synthesis import frequency_responses

    top = float(model_modes(truth, made.modes).flexible().frequencies[made.modes - 1])
    f = np.linspace(0.02 * top, 1.15 * top, LINES)
    rows = np.array([truth.place[s] for s in made.sensors])
    exact = frequency_responses(truth, f, rows, rows[-1:], "acceleration")
    random = np.random.default_rng(SEED)
    level = RESPONSE_NOISE * np.sqrt(np.mean(np.abs(exact) ** 2, axis=0, keepdims=True))
    noise = random.standard_normal(exact.shape) + 1j * random.standard_normal(exact.shape)
    nodes = np.array([int(s[1:].partition(".")[0]) for s in made.sensors])
    np.savez(
        path,
        frequency=f,
        H=exact + level * noise / np.sqrt(2.0),
        variance=np.broadcast_to(level**2, exact.shape),
        response_node=nodes,
        response_dof=np.ones(len(nodes), dtype=int),
        reference_node=nodes[-1:],
        reference_dof=np.ones(1, dtype=int),
    )
