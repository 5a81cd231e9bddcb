"""Frequency responses before and after on the page of `run`."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from cvxupdate.correlate.overlay import FrfOverlay
from cvxupdate.report.overlay_figures import overlay_parts


def curve(recording: str, use: str, fitted: tuple[float, ...] = ()) -> FrfOverlay:
    f = np.linspace(10.0, 100.0, 40)
    H = 1.0 / np.abs(1.0 - (f / 47.0) ** 2 + 0.02j)
    return FrfOverlay(
        recording, use, "n3.z", "n1.z", "acceleration", f, H, 0.5 * H, 0.98 * H, 0.5, 0.02, fitted
    )


def parts(moved: bool, *curves: FrfOverlay) -> list[dict[str, Any]]:
    return overlay_parts(SimpleNamespace(overlays=curves), moved)  # type: ignore[arg-type]


def test_each_recording_has_a_figure_that_says_whether_it_was_fitted() -> None:
    both = (curve("first", "fit", (30.0, 60.0)), curve("second", "hold-out"))
    fitted, held = parts(True, *both)
    assert fitted["says"] == "first (fitted, at the lines marked below)."
    assert held["says"] == "second (held out: never fitted)."
    for part in (fitted, held):
        assert "model after" in part["figure"] and "m/s²/N" in part["figure"]
        assert "error 0.500 → 0.020" in part["figure"]
    assert "first" in fitted["figure"] and "first" not in held["figure"]


def test_a_model_that_did_not_move_has_no_curve_after() -> None:
    (part,) = parts(False, curve("first", "fit"))
    assert ">model after<" not in part["figure"] and "→" not in part["figure"]
    assert parts(True) == []
