"""Modes in memory: identified ones as a recording, and those of a model."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

import numpy as np

from cvxupdate.api.arrays import Numbers, numbers, optional
from cvxupdate.api.places import Place, place_of, places_of
from cvxupdate.api.shared import counted, origin_keys, settings_of
from cvxupdate.errors import InputError
from cvxupdate.recordings.types import ModeTable
from cvxupdate.spec.given import plain
from cvxupdate.spec.mode_columns import gather_modes


class Modes:
    """Natural frequencies with what else is known of the modes: a recording, or what a model has.

    Parameters
    ----------
    frequencies : (modes,) Hz.
    shapes : (channels, modes), a column for each mode, real or complex; None where unknown.
    labels : the place of each row of ``shapes``: ``"n4.z"``, ``"4:-Z"``, ``(4, "z")``.
    damping : (modes,) fractions of critical, or one for all.
    frequency_std, damping_std : standard deviations (Hz; fractions), (modes,) or one for all.
    shape_std : of the entries, (channels, modes) or one for all.
    covariance : instead of both, of the frequencies (Hz²), or of those and then of the entries of
        the shapes, mode by mode: as many rows and columns.
    settings : further keys of [[recordings]]: ``use = "hold-out"``, ``name``, ``level``.

    Raises
    ------
    InputError
        When shapes do not agree, or something is no number.
    """

    def __init__(
        self,
        frequencies: Any,
        shapes: Any = None,
        labels: Any = None,
        *,
        damping: Any = None,
        frequency_std: Any = None,
        damping_std: Any = None,
        shape_std: Any = None,
        covariance: Any = None,
        **settings: Any,
    ) -> None:
        f = numbers(frequencies, "frequencies", 1)
        if np.any(f <= 0.0):
            raise InputError("frequencies: must be above 0 Hz. Leave rigid-body modes out.")
        self.frequencies = f
        self.shapes: Numbers | None = None
        self.labels: tuple[str, ...] = ()
        if shapes is not None:
            given = numbers(shapes, "shapes", (1, 2), complex)
            values = given[:, None] if given.ndim == 1 else given
            if values.shape[1] != len(f):
                raise InputError(
                    f"shapes: have {values.shape[1]} columns for {len(f)} frequencies. Give a "
                    "column for each mode (turn the array if its rows are the modes)."
                )
            places = places_of(labels, values.shape[0], "labels")
            values = values * np.array([p.sign for p in places])[:, None]
            self.shapes = values if np.iscomplexobj(shapes) and np.any(values.imag) else values.real
            self.labels = tuple(p.label for p in places)
            if len(set(self.labels)) < len(self.labels):
                raise InputError("labels: two rows of the shapes have one place.")
        elif labels is not None:
            raise InputError("labels: there are no shapes whose rows they could name.")
        self.damping = _each(damping, len(f), "damping")
        self.frequency_std = _each(frequency_std, len(f), "frequency_std")
        self.damping_std = _each(damping_std, len(f), "damping_std")
        self.shape_std: Numbers | None = None
        if shape_std is not None:
            if self.shapes is None:
                raise InputError("shape_std: there are no shapes.")
            std = numbers(shape_std, "shape_std", (0, 2))
            if np.any(std < 0.0) or std.shape not in ((), self.shapes.shape):
                raise InputError(
                    "shape_std: give one number, or the shape of shapes; none below 0."
                )
            self.shape_std = np.broadcast_to(std, self.shapes.shape).copy()
        self.covariance: Numbers | None = None
        if covariance is not None:
            C = numbers(covariance, "covariance", 2)
            n, every = len(f), len(f) * (1 + len(self.labels))
            if C.shape not in ((n, n), (every, every)):
                raise InputError(
                    f"covariance: is {C.shape[0]} × {C.shape[1]}. Give {n} × {n}, of the "
                    f"frequencies, or {every} × {every}, of the shapes' entries as well."
                )
            signs = np.array([p.sign for p in places] if shapes is not None else [])
            self.covariance = C * _signs(n, len(C), signs)
        self._settings = settings_of(settings)

    @classmethod
    def of_recording(cls, table: ModeTable) -> Modes:
        """From a recording that was read. Modes without a shape are left out where others have
        one."""
        whole = None if table.shapes is None else ~np.isnan(table.shapes).any(axis=1)
        keep = np.flatnonzero(np.ones(len(table.frequency)) if whole is None else whole)
        if not len(keep):
            raise InputError(f"{table.origin.name}: no mode has a whole shape.")
        std = table.shape_std
        deviations = None if std is None or np.isnan(std[keep]).any() else std[keep].T

        C, count, n = table.covariance, len(table.channels), len(table.frequency)
        if C is not None:
            at = _rows(n, keep, count, range(count) if len(C) > n else ())
            C = C[np.ix_(at, at)]

        def known(values: Numbers) -> Numbers | None:
            return None if np.isnan(values[keep]).any() else values[keep]

        return cls(
            table.frequency[keep],
            None if table.shapes is None else table.shapes[keep].T,
            None if table.shapes is None else [f"{c.node}.{c.dof}" for c in table.channels],
            damping=known(table.damping),
            frequency_std=None if table.relative_only else known(table.frequency_std),
            damping_std=known(table.damping_std),
            shape_std=deviations,
            covariance=C,
            **origin_keys(table.origin),
        )

    @classmethod
    def from_file(cls, file: str | os.PathLike[str], **keys: Any) -> Modes:
        """From a file of any format that `inspect` knows; ``keys`` are those of [[recordings]]."""
        from cvxupdate.api.files import recording_of

        found = recording_of("modes", file, keys)
        if not isinstance(found, ModeTable):
            raise InputError(f"{file}: holds no table of modes.")
        return cls.of_recording(found)

    @classmethod
    def from_pandas(cls, frame: Any, **keys: Any) -> Modes:
        """From a DataFrame with a row for each mode: ``frequency`` (also ``frequency_Hz``, ``f``),
        ``damping`` or ``damping_pct``, ``frequency_std``, and a column for each DOF (``n4.z``,
        ``4:+Z``, ``4:+Z re`` and ``4:+Z im``)."""
        rows = plain(frame, "the DataFrame")
        if not isinstance(rows, list) or not rows:
            raise InputError("give a DataFrame with a row for each mode.")
        recording: dict[str, Any] = {}
        made = gather_modes(recording, rows)
        if any("frequency" not in row for row in made):
            raise InputError(
                "the DataFrame has no column of frequencies (frequency, frequency_Hz or f), or a "
                f"row lacks its own. It has {', '.join(map(str, frame.columns))}."
            )
        shapes = labels = None
        if recording.get("channels"):
            entries = [
                [complex(*e) if isinstance(e, list) else e for e in r["shape"]] for r in made
            ]
            shapes = np.array(entries).T
            labels = [(c["node"], c["dof"]) for c in recording["channels"]]
            sign = [c.get("sign", 1) for c in recording["channels"]]
            shapes = shapes * np.array(sign)[:, None]

        def column(name: str) -> list[Any] | None:
            has = [row.get(name) for row in made]
            return None if None in has else has

        told = {k: column(k) for k in ("damping", "frequency_std", "damping_std")}
        return cls([row["frequency"] for row in made], shapes, labels, **{**told, **keys})

    def at(self, labels: Any) -> Modes:
        """The same modes at some places only, as sensors there would see them."""
        if self.shapes is None:
            raise InputError("at: these modes have no shapes.")
        places = places_of(labels, None, "labels")
        rows = [self._row(p) for p in places]
        signs = np.array([p.sign for p in places])[:, None]
        std, C, n = self.shape_std, self.covariance, len(self)
        if C is not None and len(C) > n:
            kept = _rows(n, np.arange(n), len(self.labels), rows)
            C = C[np.ix_(kept, kept)]
        return Modes(
            self.frequencies,
            self.shapes[rows] * signs,
            [Place(p.node, p.dof) for p in places],
            damping=self.damping,
            frequency_std=self.frequency_std,
            damping_std=self.damping_std,
            shape_std=None if std is None else std[rows],
            covariance=None if C is None else C * _signs(n, len(C), signs.ravel()),
            **self._settings,
        )

    def _row(self, place: Place) -> int:
        if place.label not in self.labels:
            raise InputError(
                f"{place.label}: these modes have no such place. They have "
                f"{', '.join(self.labels[:12])}{' …' if len(self.labels) > 12 else ''}."
            )
        return self.labels.index(place.label)

    def table(self) -> dict[str, Any]:
        """The [[recordings]] table that stands for it, every row inline."""
        rows: list[dict[str, Any]] = []
        for m, f in enumerate(self.frequencies.tolist()):
            row: dict[str, Any] = {"frequency": f}
            for key, values in (
                ("frequency_std", self.frequency_std),
                ("damping", self.damping),
                ("damping_std", self.damping_std),
            ):
                if values is not None:
                    row[key] = float(values[m])
            if self.shapes is not None:
                row["shape"] = plain(self.shapes[:, m])
            if self.shape_std is not None:
                row["shape_std"] = self.shape_std[:, m].tolist()
            rows.append(row)
        places = [place_of(label) for label in self.labels]
        channels = [
            {"column": i, "quantity": "displacement", "node": p.node, "dof": p.dof}
            for i, p in enumerate(places)
        ]
        shaped: dict[str, Any] = {"channels": channels} if channels else {}
        if self.covariance is not None:
            shaped["covariance"] = self.covariance.tolist()
        return {"kind": "modes", "rows": rows, **shaped, **self._settings}

    def to_dataframe(self) -> Any:
        """A pandas DataFrame: a row for each mode, a column for each DOF of the shapes."""
        pandas = optional("pandas", "to_dataframe")
        columns: dict[str, Any] = {"frequency": self.frequencies}
        for name in ("frequency_std", "damping", "damping_std"):
            values = getattr(self, name)
            if values is not None:
                columns[name] = values
        if self.shapes is not None:
            for label, row in zip(self.labels, self.shapes, strict=True):
                parts = (
                    {"": row} if not np.iscomplexobj(row) else {" re": row.real, " im": row.imag}
                )
                columns |= {f"{label}{part}": values for part, values in parts.items()}
        return pandas.DataFrame(
            columns, pandas.RangeIndex(1, len(self.frequencies) + 1, name="mode")
        )

    def __len__(self) -> int:
        return len(self.frequencies)

    def __repr__(self) -> str:
        f = ", ".join(f"{x:.4g}" for x in self.frequencies[:5])
        shapes = f", shapes at {counted(len(self.labels), 'DOF')}" if self.labels else ""
        more = ", …" if len(self) > 5 else ""
        return f"Modes({counted(len(self), 'mode')}: {f}{more} Hz{shapes})"


def _rows(n: int, keep: Numbers, width: int, channels: Iterable[int]) -> list[int]:
    """The rows of a covariance of ``n`` modes with ``width`` channels each: of the modes ``keep``,
    and of their entries at ``channels``."""
    entries = list(channels)
    return [*keep.tolist(), *(n + int(m) * width + c for m in keep for c in entries)]


def _signs(n: int, size: int, signs: Numbers) -> Numbers:
    """What turned channels make of a covariance of ``n`` modes."""
    every = np.concatenate([np.ones(n), np.tile(signs, n)])[:size]
    return np.outer(every, every)


def _each(given: Any, count: int, what: str) -> Numbers | None:
    """One number for each mode."""
    if given is None:
        return None
    values = numbers(given, what, (0, 1))
    if values.ndim == 1 and len(values) != count:
        raise InputError(f"{what}: {len(values)} for {count} modes. Give one for each, or one.")
    if np.any(values < 0.0):
        raise InputError(f"{what}: must not be negative.")
    return np.broadcast_to(values, (count,)).copy()
