"""Figures across the page have letters as large as others', whether of one panel or two."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest

from cvxupdate.report.diagnosis_curves import WHOLE, remains


def spectrum(use: str) -> SimpleNamespace:
    lines = np.linspace(1.0, 100.0, 50)
    return SimpleNamespace(
        frequency=lines, before=1.0 + 0 * lines, after=0.1 + 0 * lines, noise=0.01 * lines, use=use
    )


@pytest.mark.parametrize("uses", [("fit",), ("fit", "hold-out")])
def test_what_remains_is_drawn_as_wide_as_it_stands(uses) -> None:
    picture = remains(SimpleNamespace(spectra=tuple(map(spectrum, uses))))
    width = float(re.search(r'viewBox="0 0 ([\d.]+)', picture).group(1))
    assert width == pytest.approx(72.0 * WHOLE, rel=0.02)
