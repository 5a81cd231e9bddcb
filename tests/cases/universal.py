"""Data sets of a universal file (UFF) as pyuff prepares them."""

from __future__ import annotations

import numpy as np


def uff_sets() -> list[dict[str, object]]:
    """FRFs, coherence, a time history, nodes, units and a shape, as pyuff has them."""
    import pyuff

    f = 10.0 + 0.5 * np.arange(40)
    sets: list[dict[str, object]] = [pyuff.prepare_164(1, "SI", 1, 1.0, 1.0, 1.0, 0.0)]
    sets.append(
        pyuff.prepare_15([1, 2], [0, 0], [0, 0], [0, 0], [0.0, 1.0], [0.0, 0.0], [0.0, 0.5])
    )
    for node, direction in ((1, 3), (2, -3)):
        sets.append(
            pyuff.prepare_58(
                binary=node - 1,
                func_type=4,
                rsp_node=node,
                rsp_dir=direction,
                ref_node=1,
                ref_dir=3,
                data=(node + f) * np.exp(1j * f),
                x=f,
                id1="frf",
                rsp_ent_name="a",
                ref_ent_name="b",
                abscissa_spacing=1,
                abscissa_spec_data_type=18,
                ordinate_spec_data_type=12,
                orddenom_spec_data_type=13,
            )
        )
    sets.append(
        pyuff.prepare_55(
            model_type=1,
            id1="a",
            id2="b",
            id3="c",
            id4="d",
            id5="e",
            analysis_type=2,
            data_ch=2,
            spec_data_type=8,
            data_type=2,
            n_data_per_node=3,
            r1=np.zeros(2),
            r2=np.zeros(2),
            r3=np.array([0.5, 1.0]),
            load_case=1,
            mode_n=1,
            freq=12.5,
            modal_m=1.0,
            modal_damp_vis=0.01,
            modal_damp_his=0.0,
            node_nums=[1, 2],
        )
    )
    return sets
