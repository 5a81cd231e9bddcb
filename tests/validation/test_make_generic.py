"""The closed forms that the problems of chapter 7 aim at, and that their files are what the script
writes."""

import numpy as np
import pytest

from validation import make_generic as mg


def test_the_rod_is_the_series_of_its_modes() -> None:
    """Fixed-free: sin((2n − 1) π x / 2L) over ωₙ² (1 + iη) − ω²."""
    H = mg.line_receptances("rod")
    f = np.array([310.0, 4200.0, 11111.0])
    A, L, rho = np.pi * mg.ROD["d"] ** 2 / 4, mg.ROD["L"], mg.ROD["rho"]
    n = np.arange(1, 200001)
    k = (2 * n - 1) * np.pi / (2 * L)
    x, y = 0.3, 0.1
    for row, line in zip(H(f, 1), f, strict=True):
        below = k**2 * mg.E / rho * (1 + 1j * mg.ETA) - (2 * np.pi * line) ** 2
        series = np.sum(2 / (rho * A * L) * np.sin(k * x) * np.sin(k * y) / below)
        assert row[3] == pytest.approx(series, rel=1e-4)


def test_the_beam_is_that_of_ever_finer_elements() -> None:
    """Free-free, in the band of case B: at its own resonances (4.7300, 7.8532, … for βL) and
    reciprocal."""
    H = mg.line_receptances("beam")
    f = np.array([800.0, 4600.0])
    np.testing.assert_allclose(H(f, 2)[:, 7], H(f, 7)[:, 2], rtol=1e-8)
    b, h = mg.BEAM["width"], mg.BEAM["height"]
    first = 4.730040745**2 / 2 / np.pi * np.sqrt(mg.E * h**2 / 12 / mg.BEAM["rho"])
    near = first * np.array([0.9, 1.0, 1.1])
    assert np.argmax(np.abs(H(near, 0)[:, 0])) == 1
    mass = mg.BEAM["rho"] * b * h
    low = H(np.array([0.5]), 0)[0, 0]  # rigid: 1/m + (L/2)²/J = 4/m at an end
    assert low == pytest.approx(-4 / mass / (2 * np.pi * 0.5) ** 2, rel=1e-3)


@pytest.mark.parametrize("text", [mg.line_text("rod", 7850.0, 0.0), mg.plate_text(3)])
def test_a_model_of_the_text(text: str) -> None:
    model = mg.build(text)
    assert model.size == (10 if "rod" in text else 48)


def test_the_shared_models_are_those_of_the_script() -> None:
    written = {
        "beam_a": mg.line_text("beam", mg.BEAM["rho"], 0.9 * mg.BEAM["height"]),
        "beam_b": mg.line_text("beam", mg.BEAM["rho"], mg.BEAM["height"]),
        "plate": mg.plate_text(3),
        "plate_a": mg.plate_text(3, wrong=True),
        "rod": mg.line_text("rod", 0.9 * mg.ROD["rho"], 0.0),
    }
    for name, text in written.items():
        assert (mg.PROBLEMS / f"{name}.toml").read_text(encoding="utf-8") == text
