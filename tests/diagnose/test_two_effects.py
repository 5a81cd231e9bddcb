"""Something linear and a law at once, found from one set of recordings at two levels (and a third
level held out): an added mass and a gap, a loose spring and friction. Marched by
`validation.nonlinear`, which shares nothing with the package."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from cvxupdate.study import diagnose
from validation.nonlinear import Truth, chain, drive, responses

LEVELS = (1.0, 4.0, 3.0)
SAMPLES = {"clearance": 384, "dry_friction": 512}  # as many as it takes
SEEDS = {"clearance": 11, "dry_friction": 8}  # of the chain: three masses, five
LUMP, LOOSE = 0.9, 0.72  # kg; of a spring's stiffness
# laws and the linear effects that a chain is made of: all words take twice as long
SPRINGS = ("stiffness_change", "added_mass", "clearance", "cubic_stiffness")
RUBS = ("dry_friction", "hysteresis")
WORDS = {
    "clearance": (*SPRINGS, *RUBS),
    "dry_friction": (*SPRINGS, *RUBS, "viscous_damper", "quadratic_damping"),
}
RUN = """[[recordings]]
kind = "time"
use = "{use}"
level = {level}
file = "run{number}.npz"
response = "acceleration"
rate = {rate}
channels = [ {channels} ]
"""


def written(folder: Path, law: str) -> tuple[Path, Truth, int]:
    """(a problem file, the law that is concealed, the node or the spring that is changed)."""
    rng = np.random.default_rng(SEEDS[law])
    s, samples = chain(rng), SAMPLES[law]
    n = len(s.K)
    K, M, other = s.K.copy(), s.M.copy(), n - 1
    if law == "clearance":
        M[other - 1, other - 1] += LUMP
    else:
        K -= (1.0 - LOOSE) * s.parts[f"storey {other}"][0]
    f = np.sqrt(eigh(K, M, eigvals_only=True)) / (2.0 * np.pi)
    top, zeta = 1.3 * f[2], np.full(n, s.zeta)
    rate, row = 3.0 * top, n - 1
    push = [60.0 * level * drive(rng, samples, rate, (0.4 * f[0], top)) for level in LEVELS]
    still = Truth("none", (row,), {})
    _, x, _ = responses(K, M, zeta, still, 0, push[2], rate, (0.0, 0.0), n)
    far, stiff = float(np.std(x)), 1.0 / float(np.linalg.inv(K)[row, row])
    sizes = {"k": stiff, "gap": 0.8 * far, "two": 0.0}
    if law == "dry_friction":
        sizes = {"force": 0.15 * stiff * far, "slow": 1e-3 * far * 2.0 * np.pi * float(f[0])}
    truth = Truth(law, (row,), sizes)
    channels = ['{ column = 0, quantity = "force", node = 1, dof = "x" }']
    channels += [
        f'{{ column = {k + 1}, quantity = "acceleration", node = {k + 1}, dof = "x" }}'
        for k in range(n)
    ]
    text = f'title = "{law}"\n{s.text}\n'
    for k, (level, force) in enumerate(zip(LEVELS, push, strict=True)):
        a, _, _ = responses(K, M, zeta, truth, 0, force, rate, (0.0, 0.0), n)
        a += 0.005 * np.std(a, axis=0) * rng.standard_normal(a.shape)
        np.savez(folder / f"run{k}.npz", data=np.column_stack([force, a]))
        use = "hold-out" if k == 2 else "fit"
        text += RUN.format(use=use, level=level, number=k, rate=rate, channels=", ".join(channels))
    path = folder / "problem.toml"
    path.write_text(f"{text}[diagnose]\nphysics = {list(WORDS[law])}\n")
    return path, truth, other


@pytest.mark.slow
def test_an_added_mass_and_a_gap(tmp_path: Path) -> None:
    path, truth, node = written(tmp_path, "clearance")
    diagnosis = diagnose(path)
    found = {f.physics: f for f in diagnosis.findings}
    lump, gap = found["added_mass"], found["clearance"]
    assert lump.place.nodes == (node,) and gap.place.nodes == (truth.rows[0] + 1,)
    assert lump.parameters["m"] == pytest.approx(LUMP, rel=0.1)
    assert gap.parameters["gap"] == pytest.approx(truth.sizes["gap"], rel=0.1)
    assert gap.parameters["k"] == pytest.approx(truth.sizes["k"], rel=0.1)
    again = tmp_path / "updated" / "problem.toml"
    again.parent.mkdir()
    assert diagnosis.updated is not None
    again.write_text(diagnosis.updated.text_in(again.parent))
    assert diagnose(again).verdict == "consistent", "its own law foretells what the level changes"


@pytest.mark.proof
def test_a_loose_spring_and_friction(tmp_path: Path) -> None:
    path, truth, number = written(tmp_path, "dry_friction")
    found = {f.physics: f for f in diagnose(path).findings}
    spring, rubs = found["stiffness_change"], found["dry_friction"]
    assert spring.place.elements == (100 + number,)
    assert rubs.place.nodes == (truth.rows[0] + 1,)
    assert spring.parameters["factor"] == pytest.approx(LOOSE, rel=0.05)
    assert rubs.parameters["force"] == pytest.approx(truth.sizes["force"], rel=0.1)
