"""Cases as problem folders, from the bodies that are kept, or from CalculiX where it is there."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import cast

import numpy as np

from validation.generated.cases import Case
from validation.generated.files import model_text, recordings_text, truth_text
from validation.generated.laboratory import Modal, build, modal
from validation.plates import frames, solids
from validation.plates.bodies import Body, load, points_of, save
from validation.plates.cases import draw

KEPT = Path(__file__).resolve().parent / "kept"


def kept(seed: int) -> Path:
    """The file of a case's body."""
    return KEPT / f"{seed}.npz"


def computed(case: Case) -> Body:
    """The body of a case by CalculiX, where it is heard and driven."""
    with tempfile.TemporaryDirectory() as name:
        solid = case.design.family == "plate"
        body = (solids if solid else frames).body_of(case, Path(name))
    return body.at(points_of(case))


def remember(seed: int) -> Path:
    """Compute a case's body and keep it."""
    save(kept(seed), computed(draw(seed)))
    return kept(seed)


def make(seed: int, folder: Path) -> Case:
    """Write the folder of a case: what diagnosis sees, and the truth."""
    case, path = draw(seed), kept(seed)
    body = load(path) if path.exists() else computed(case)
    m = cast(Modal, body.with_losses(case.zeta, case.effects))
    rng = np.random.default_rng([20261124, seed])
    folder.mkdir(parents=True, exist_ok=True)
    family = case.design.family
    out = [f'title = "{family.capitalize()} {seed}"', 'source = "CalculiX"', ""]
    out += model_text(case.design) + recordings_text(rng, m, case, folder)
    (folder / "problem.toml").write_text("\n".join(out) + "\n", encoding="utf-8")
    # how clearly an effect can be seen is told by the laboratory that has what else may move
    here = modal(build(case.design, case.scatter, case.effects), case.top, case.zeta)
    truth = truth_text(case, m, here)
    (folder / "truth.toml").write_text("\n".join(truth) + "\n", encoding="utf-8")
    return case
