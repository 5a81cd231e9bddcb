"""Frequency response functions in memory as a recording."""

from __future__ import annotations

import os
from functools import cached_property
from typing import Any

import numpy as np

from cvxupdate.api.arrays import Numbers, numbers, optional
from cvxupdate.api.held import Held
from cvxupdate.api.places import places_of
from cvxupdate.api.shared import RATIOS, counted, motion_of, origin_keys, settings_of
from cvxupdate.errors import InputError, RecordingError
from cvxupdate.recordings.types import DOF_KINDS, FrequencyResponse
from cvxupdate.recordings.units import scale_to_si

UFF_QUANTITIES = {8: "displacement", 11: "velocity", 12: "acceleration"}
"""The codes of universal files for the quantity of an ordinate."""


class Frf:
    """Frequency response functions.

    Parameters
    ----------
    frequencies : (lines,) Hz, increasing.
    H : (lines, responses, references), or (lines, responses) with one reference, or (lines,);
        complex, in SI per newton unless ``unit`` says otherwise (``"g/N"``).
    responses, references : where each sits: ``"n4.z"``, ``"4:-Z"``, ``(4, "z")``.
    quantity : displacement, velocity or acceleration (or receptance, mobility, accelerance).
    variance : E|H − EH|² of each entry, the shape of H, in the unit of H squared.
    coherence : (lines, responses) or the shape of H.
    settings : further keys of [[recordings]]: ``use = "hold-out"``, ``name``, ``band``, ``level``,
        ``averages``.

    Raises
    ------
    InputError
        When shapes do not agree, or something is no number.
    """

    def __init__(
        self,
        frequencies: Any,
        H: Any,
        responses: Any,
        references: Any,
        *,
        quantity: str,
        unit: str = "",
        variance: Any = None,
        coherence: Any = None,
        **settings: Any,
    ) -> None:
        self.quantity = motion_of(quantity)
        f = numbers(frequencies, "frequencies", 1)
        if len(f) < 2 or np.any(np.diff(f) <= 0.0) or f[0] < 0.0:
            raise InputError("frequencies: give at least two, in Hz, from 0 upwards, increasing.")
        values = _three_axes(numbers(H, "H", (1, 2, 3), complex))
        if len(values) != len(f):
            raise InputError(
                f"H: has {len(values)} lines for {len(f)} frequencies. Its axes are frequency, "
                "response, reference."
            )
        self.responses = places_of(responses, values.shape[1], "responses")
        self.references = places_of(references, values.shape[2], "references")
        scale = self._scale(unit)
        self.frequencies, self.H = f, values * scale
        self.variance = None
        if variance is not None:
            v = _three_axes(numbers(variance, "variance", (1, 2, 3)))
            self.variance = _alike(v, values.shape, "variance") * np.abs(scale) ** 2
        self.coherence = None
        if coherence is not None:
            given = numbers(coherence, "coherence", (1, 2, 3))
            if given.ndim == 2 and given.shape == values.shape[:2]:
                self.coherence = given
            else:
                self.coherence = _alike(_three_axes(given), values.shape, "coherence")
        self._settings = settings_of(settings)

    def _scale(self, unit: str) -> Numbers:
        """Unit and signs of the places: (responses, references)."""
        try:
            rows = [
                scale_to_si(self.quantity, unit, p.dof, None, p.sign, "force")
                for p in self.responses
            ]
        except RecordingError as error:
            raise InputError(f"unit: {error}") from None
        return np.outer(rows, [p.sign for p in self.references])

    @classmethod
    def of_recording(cls, frf: FrequencyResponse) -> Frf:
        """From a recording that was read."""
        if any(not c.dof for c in frf.references):
            raise InputError(f"{frf.origin.name}: is a spectrum without a force, not an FRF.")
        return cls(
            frf.frequency,
            frf.H,
            [f"{c.node}.{c.dof}" for c in frf.responses],
            [f"{c.node}.{c.dof}" for c in frf.references],
            quantity=frf.quantity,
            variance=frf.variance,
            coherence=None
            if frf.coherence is None or np.isnan(frf.coherence).any()
            else frf.coherence,
            **origin_keys(frf.origin),
        )

    @classmethod
    def from_file(cls, file: str | os.PathLike[str], **keys: Any) -> Frf:
        """From a file of any format that `inspect` knows; ``keys`` are those of [[recordings]]:
        response, channels, references, node_map, variables …"""
        from cvxupdate.api.files import recording_of

        found = recording_of("frf", file, keys)
        if not isinstance(found, FrequencyResponse):
            raise InputError(f"{file}: holds no frequency responses.")
        return cls.of_recording(found)

    @classmethod
    def from_pandas(cls, frame: Any, references: Any = None, **keys: Any) -> Frf:
        """From a DataFrame: frequencies in Hz as its index, a complex column for each response.

        Columns are places (``"n4.z"``), or pairs (response, reference) of all combinations, as
        `to_dataframe` gives them; ``references`` is the one reference in the first case.
        """
        columns = list(frame.columns)
        if not columns:
            raise InputError("the DataFrame has no columns.")
        if references is None and all(isinstance(c, tuple) and len(c) == 2 for c in columns):
            outputs, inputs = (list(dict.fromkeys(c[k] for c in columns)) for k in (0, 1))
            if len(columns) != len(outputs) * len(inputs):
                raise InputError("the DataFrame lacks some pairs of response and reference.")
            values = np.stack(
                [np.stack([frame[o, i].to_numpy() for i in inputs], 1) for o in outputs], 1
            )
            return cls(frame.index.to_numpy(), values, outputs, inputs, **keys)
        return cls(frame.index.to_numpy(), frame.to_numpy(), columns, references, **keys)

    @classmethod
    def from_xarray(cls, array: Any, **keys: Any) -> Frf:
        """From a DataArray with the dimensions frequency, response and reference (the last one may
        be a coordinate without a dimension), whose coordinates are Hz and places."""
        names = {str(d).lower(): d for d in array.dims}
        if "frequency" not in names or "response" not in names:
            raise InputError(
                f"the DataArray has the dimensions {', '.join(map(str, array.dims))}; frequency, "
                "response and reference are needed."
            )
        order = [names[n] for n in ("frequency", "response", "reference") if n in names]
        turned = array.transpose(*order)
        if "reference" not in {str(c).lower() for c in array.coords}:
            raise InputError("the DataArray has no coordinate reference: where the force acts.")
        places = [turned.coords[names.get(n, n)].values.tolist() for n in ("response", "reference")]
        return cls(turned.coords[names["frequency"]].values, turned.values, *places, **keys)

    @classmethod
    def from_uff(cls, sets: Any, quantity: str | None = None, **keys: Any) -> Frf:
        """From data sets 58 as pyuff reads them: a list of dictionaries, one for each pair of
        response and reference."""
        from cvxupdate.api.files import uff_entries

        f, H, outputs, inputs, told = uff_entries(sets)
        known = quantity or UFF_QUANTITIES.get(told)
        if known is None:
            raise InputError(
                "the data sets do not say which motion they hold. Give quantity, e.g. acceleration."
            )
        return cls(f, H, outputs, inputs, quantity=known, **keys)

    @cached_property
    def _held(self) -> Held:
        arrays = {
            "frequency": self.frequencies,
            "H": self.H,
            "variance": self.variance,
            "coherence": self.coherence,
        }
        for who, places in (("response", self.responses), ("reference", self.references)):
            arrays[f"{who}_node"] = np.array([p.node for p in places])
            arrays[f"{who}_dof"] = np.array([DOF_KINDS.index(p.dof) + 1 for p in places])
        return Held("frf", {k: v for k, v in arrays.items() if v is not None})

    def table(self) -> dict[str, Any]:
        """The [[recordings]] table that stands for it."""
        file = str(self._held.path)
        return {"kind": "frf", "file": file, "response": self.quantity, **self._settings}

    def to_dataframe(self) -> Any:
        """A pandas DataFrame: frequencies as index, a column for each (response, reference)."""
        pandas = optional("pandas", "to_dataframe")
        pairs = [(o.label, i.label) for o in self.responses for i in self.references]
        columns = pandas.MultiIndex.from_tuples(pairs, names=["response", "reference"])
        index = pandas.Index(self.frequencies, name="frequency (Hz)")
        return pandas.DataFrame(self.H.reshape(len(self.frequencies), -1), index, columns)

    def plot(self) -> Any:
        """Moduli and phases over frequency, as a matplotlib figure."""
        from cvxupdate.report.plots import frf_figure

        pairs = [(o.label, i.label) for o in self.responses for i in self.references]
        curves = self.H.reshape(len(self.frequencies), -1)
        return frf_figure(self.frequencies, curves, pairs, RATIOS[self.quantity])

    def __repr__(self) -> str:
        f = self.frequencies
        return (
            f"Frf({counted(len(self.responses), 'response')} to "
            f"{counted(len(self.references), 'reference')}, {len(f)} lines from {f[0]:g} to "
            f"{f[-1]:g} Hz, {self.quantity})"
        )


def _three_axes(values: Numbers) -> Numbers:
    return values.reshape((*values.shape, *(1,) * (3 - values.ndim)))


def _alike(values: Numbers, shape: tuple[int, ...], what: str) -> Numbers:
    if values.shape != shape:
        raise InputError(f"{what}: has shape {values.shape}, H {shape}. They must agree.")
    return values
