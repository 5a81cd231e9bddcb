"""The six case studies of section 6.4.1 on the bay structure: writes
problems/ceam/case1 … case6 with their simulated recordings and twins for the RFM.

Run as a script (about two minutes, nearly all of it the modal identification of case 3). Modes are
those of scipy.linalg on the package's matrices; receptances come from the bay's own dense
inversion.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import scipy.linalg as la

from validation import make_bay as b

STUDY = Path(__file__).resolve().parents[1] / "problems" / "ceam"
KINDS = ("x", "y", "z", "rx", "ry", "rz")
ETA = 0.01
DAMPING = f'[model.damping]\nkind = "structural"\neta = {ETA}'
LOSSY = tuple(range(1, 21, 2))
"""Case 2: only these elements of X1 have a loss factor."""
LINES = np.arange(1.0, 250.25, 0.5)
FORCES, SEEN = (
    ("n1.x", "n1.y", "n1.z"),
    ("n1.x", "n1.y", "n1.z", "n5.z", "n7.z", "n9.z", "n11.y", "n13.z", "n15.z", "n18.z"),
)
"""Held-out accelerances, 1 to 250 Hz: driven at one corner, seen at ten coordinates. Receptances
would be all rigid-body motion at 1 Hz."""


def modes_of(model, count, damped=False):
    """The lowest ``count`` flexible modes: (λ, shapes (N, m) with a largest entry of 1)."""
    m = model.matrices()
    K, M, D = (x.toarray() for x in (m.K, m.M, m.D))
    values, shapes = la.eig(K + 1j * D, M) if damped else la.eigh(K, M)
    order = np.argsort(values.real)
    order = order[values.real[order] > (2 * np.pi) ** 2][:count]
    shapes = shapes[:, order]
    return values[order], shapes / shapes[
        np.argmax(np.abs(shapes), axis=0), np.arange(shapes.shape[1])
    ]


def modes_of_matrices(K, M, count):
    """The lowest ``count`` flexible modes of two matrices: (λ, shapes)."""
    values, shapes = la.eigh(K, M)
    flexible = np.flatnonzero(values > (2 * np.pi) ** 2)[:count]
    return values[flexible], shapes[:, flexible]


def lossy_toml():
    """Model X1 whose elements LOSSY alone have a loss factor: not proportional."""
    text = b.model_toml("X1")
    lossy = f"[model.materials.lossy]\nE = {b.E:.6g}\nnu = {b.NU}\nrho = {b.RHO}\neta = {ETA}\n\n"
    text = text.replace("[model.sections.strip]", lossy + "[model.sections.strip]", 1)
    for i in LOSSY:
        start = text.index(f"  {{ id = {i}, nodes = [")
        end = text.index("}", start)
        text = text[:end].rstrip() + ', material = "lossy" }' + text[end + 1 :]
    return text


def opened(text):
    """The package's model of a [model] table."""
    import tempfile

    from cvxupdate.study import open_problem

    with tempfile.TemporaryDirectory() as made:
        path = Path(made) / "problem.toml"
        path.write_text(text, encoding="utf-8")
        return open_problem(path)[1]


def accelerance(model):
    """−ω² times the receptance."""
    return -((2 * np.pi * LINES) ** 2)[:, None, None] * b.receptance(model, LINES, SEEN, FORCES)


def save_modes(path, model, values, shapes, keep, std=None):
    """modes.npz: frequency, damping where there is any, shape at the DOFs ``keep``."""
    arrays = {"frequency": np.sqrt(values.real) / (2 * np.pi), "shape": shapes[keep].T}
    if np.iscomplexobj(values):
        arrays["damping"] = 0.5 * values.imag / values.real
    np.savez_compressed(path / "modes.npz", **arrays, **(std or {}))


def channels(path, labels):
    """channels.csv: place in the shape, node, DOF."""
    rows = [
        f"{k},displacement,{int(q.split('.')[0][1:])},{q.split('.')[1]}"
        for k, q in enumerate(labels)
    ]
    (path / "channels.csv").write_text(
        "\n".join(["column,quantity,node,dof", *rows]) + "\n", encoding="utf-8"
    )


MODES = (
    '[[recordings]]\nkind = "modes"\nuse = "fit"\nname = "{name}"\nfile = "{file}"\nchannels = '
    '{{ file = "{channels}" }}\n'
)
HELD = (
    '[[recordings]]\nkind = "frf"\nuse = "hold-out"\nname = "{name}, accelerances"\nfile = '
    '"frf.npz"\nresponse = "acceleration"\n'
)


def modes_block(name, file="modes.npz", channels="../channels.csv"):
    """The fitted table of modes; five of the six cases share their channels."""
    return MODES.format(name=name, file=file, channels=channels)


def parameters(*rows):
    """The [update] parameters: (property, lower, upper)."""
    return (
        "parameters = [\n"
        + "".join(
            f'  {{ elements = "all", of = "{of}", each = "element", lower = {lo}, upper = '
            f"{hi} }},\n"
            for of, lo, hi in rows
        )
        + "]\n"
    )


def write(case, title, model, recordings, update, constraints="", name="problem.toml", folder=None):
    """A problem file of a case."""
    folder = STUDY / f"case{case}" if folder is None else folder
    head = (
        f'title = "{title}"\nsource = "Thesis 6.4.1, case {case}, on the reconstruction of the '
        'bay structure: see source.md"\n\n'
    )
    parts = [head + model, "\n".join(recordings), f"[update]\n{update}"] + (
        [f"[constraints]\n{constraints}"] if constraints else []
    )
    (folder / name).write_text(
        "\n".join(parts) + ("" if parts[-1].endswith("\n") else "\n"), encoding="utf-8"
    )


def folders():
    """The six folders."""
    out = {}
    for case in range(1, 7):
        out[case] = STUDY / f"case{case}"
        out[case].mkdir(exist_ok=True)
    return out


def twin(case, title, target, model, rows, noise=0.0, constraints=""):
    """The problem of the response function method on receptances of the same structure: 24 lines
    between resonances."""
    folder = STUDY / f"case{case}"
    lines = np.arange(10.0, 250.0, 10.0)
    seen = (
        [q for q in model.labels if q.split(".")[1] in ("x", "y", "z")]
        if case == 4
        else list(model.labels)
    )
    H = b.receptance(target, lines, seen, FORCES)
    b.save_frf(folder / "frf_fit.npz", lines, b.noisy(H, noise, 7) if noise else H, seen, FORCES)
    fit = (
        '[[recordings]]\nkind = "frf"\nuse = "fit"\nname = "receptances to fit"\nfile = '
        '"frf_fit.npz"\nresponse = "displacement"\n'
    )
    write(
        case,
        f"{title} by the response function method",
        model_text[case],
        [fit, HELD.format(name="target")],
        'method = "rfm"\n' + parameters(*rows),
        constraints,
        "rfm.toml",
    )


model_text: dict[int, str] = {}


def main():
    """Write everything."""
    STUDY.mkdir(exist_ok=True)
    out = folders()
    plain, damped = b.model_toml("X1"), b.model_toml("X1", DAMPING)
    X, XD, XL, X2 = (
        opened(plain),
        opened(damped),
        opened(lossy_toml()),
        opened(b.model_toml("X2", DAMPING)),
    )
    every = np.arange(X.size)
    stiff, mass, loss = ("stiffness", -0.5, 0.5), ("mass", -0.5, 0.5), ("damping", -1.0, 1.0)
    kept = "total_mass = { conserve = true }\n"
    model_text.update(
        {
            1: b.including("FE1", "../../bay"),
            2: b.including("FE1", "../../bay", DAMPING),
            3: b.including("FE1", "../../bay", DAMPING),
            4: b.including("FE1", "../../bay", DAMPING),
            5: b.including("FE2", "../../bay", DAMPING),
            6: b.including("FE1", "../../bay", DAMPING),
        }
    )

    targets = {1: X, 2: XL, 3: XD, 4: XD, 5: XD, 6: X2}
    for case, target in targets.items():
        b.save_frf(out[case] / "frf.npz", LINES, accelerance(target), SEEN, FORCES)

    channels(STUDY, X.labels)
    values, shapes = modes_of(X, 10)
    save_modes(out[1], X, values, shapes, every)
    names = {
        1: "FE1 from ten complete real modes of X1",
        2: "FE1 from ten complete complex modes of X1, loss not proportional",
        3: "FE1 from modes identified from receptances of X1 with 5 % noise",
        4: "FE1 from twenty incomplete modes of X1 (translations)",
        5: "FE2 from twenty complete modes of X1 and thirty of its own",
        6: "FE1 from ten modes of the finer X2, in two stages",
    }
    write(
        1,
        names[1],
        model_text[1],
        [modes_block("X1"), HELD.format(name="X1")],
        'method = "ceam"\n' + parameters(stiff, mass),
        kept,
    )
    twin(1, names[1], X, X, [stiff, mass])
    whole = STUDY / "whole"  # the same recordings, read where they are
    whole.mkdir(exist_ok=True)
    near = [
        text.replace('file = "modes', 'file = "../case1/modes').replace(
            'file = "frf', 'file = "../case1/frf'
        )
        for text in (modes_block("X1"), HELD.format(name="X1"))
    ]
    write(
        1,
        "The whole stiffness matrix of FE1 on its pattern, from ten complete real modes of X1",
        model_text[1],
        near,
        'method = "ceam"\nwhole = { matrices = ["K"], pattern = "model" }\n',
        "stiffness_positive = { matrix = true, rigid_modes = true "
        '}\n\n[regularisation]\nkind = "tikhonov"\nweight = 1.0\n',
        folder=whole,
    )

    values, shapes = modes_of(XL, 10, True)
    save_modes(out[2], XL, values, shapes, every)
    write(
        2,
        names[2],
        model_text[2],
        [modes_block("X1"), HELD.format(name="X1")],
        'method = "ceam"\n' + parameters(stiff, mass, loss),
        kept,
    )
    twin(2, names[2], XL, XL, [stiff, mass, loss])

    if "--keep-modes" not in sys.argv:  # the identification takes three minutes
        identified(out[3], XD)
    tight = ("stiffness", -0.2, 0.2)
    write(
        3,
        names[3],
        model_text[3],
        [modes_block("X1, identified"), HELD.format(name="X1")],
        'method = "ceam"\n' + parameters(tight, loss),
    )
    twin(3, names[3], XD, XD, [tight, loss], 0.05)

    seen = np.flatnonzero(X.dof_kind < 3)
    for count in (20, 40, 60, 80):
        values, shapes = modes_of(X, count)
        np.savez_compressed(
            out[4] / f"modes{count}.npz",
            frequency=np.sqrt(values.real) / (2 * np.pi),
            shape=shapes[seen].T,
        )
        title = (
            names[4]
            if count == 20
            else f"FE1 from {count} incomplete modes of X1, expanded by the null-space basis (6.8)"
        )
        way = 'expansion = "null-space"\n'
        write(
            4,
            title,
            model_text[4],
            [
                modes_block("X1, translations", f"modes{count}.npz", "channels.csv"),
                HELD.format(name="X1"),
            ],
            'method = "ceam"\n' + way + parameters(stiff, mass),
            kept,
            "problem.toml" if count == 20 else f"modes{count}.toml",
        )
    channels(out[4], [X.labels[i] for i in seen])
    twin(4, names[4], XD, XD, [stiff, mass])

    values, shapes = modes_of(X, 20)
    save_modes(out[5], X, values, shapes, every)
    write(
        5,
        names[5],
        model_text[5],
        [modes_block("X1"), HELD.format(name="X1")],
        'method = "ceam"\nself_assign = 30\n' + parameters(stiff, mass),
        kept + "mass_positive = { elements = true, matrix = true, floor = 1e-3 }\n",
    )
    twin(5, names[5], XD, XD, [stiff, mass])

    values, shapes = modes_of(X2, 10)
    common = [X2.place[q] for q in X.labels]
    save_modes(out[6], X2, values.real, shapes, np.array(common))
    write(
        6,
        names[6],
        model_text[6],
        [modes_block("X2"), HELD.format(name="X2")],
        'method = "ceam"\nstages = 2\nself_assign = 60\n' + parameters(stiff),
    )
    twin(6, names[6], X2, X, [stiff])


def identified(folder, target):
    """Case 3: receptances of X1 with 5 % noise, 0.25 Hz apart to 400 Hz, and the modes that our own
    identification finds in them."""
    from cvxupdate.recordings.identify import identify_modes
    from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin

    f = np.arange(20.0, 400.0, 0.25)
    H = b.receptance(target, f, target.labels, FORCES)
    noisy = b.noisy(H, 0.05, 3)
    # Uniform in ±5 % of each part. In-plane and normal motion do not couple, so many receptances
    # are 0 with no noise: a floor keeps weights finite.
    variance = (
        2.0
        / 3.0
        * (
            0.05
            * np.maximum(
                np.abs(noisy), 0.01 * np.median(np.abs(noisy), axis=(0,), keepdims=True).max()
            )
        )
        ** 2
    )

    def channel(label, quantity):
        return Channel(int(label.split(".")[0][1:]), label.split(".")[1], quantity)

    frf = FrequencyResponse(
        Origin("X1 with 5 % noise", "simulated"),
        f,
        noisy,
        "displacement",
        tuple(channel(q, "displacement") for q in target.labels),
        tuple(channel(q, "force") for q in FORCES),
        variance,
    )
    found = identify_modes(frf, (20.0, 400.0), damping="hysteretic", max_order=40)
    keep = np.argsort(found.frequency)[:10]
    np.savez_compressed(
        folder / "modes.npz",
        frequency=found.frequency[keep],
        frequency_std=found.frequency_std[keep],
        damping=found.damping[keep],
        damping_std=found.damping_std[keep],
        shape=found.shapes[keep],
        shape_std=found.shape_std[keep],
    )
    if len(found.frequency) < 10:
        raise SystemExit(f"case 3: only {len(found.frequency)} modes were identified")
    print("case 3, identified:", found.frequency.round(3), "damping", found.damping.round(5))


if __name__ == "__main__":
    main()
