"""The closed-form methods of the literature (section 2.7): dense matrices in, dense matrices out,
with their known faults measured."""

from cvxupdate.direct.assignment import minas_inman, symmetric_gain, zimmerman_widengren
from cvxupdate.direct.baruch import baruch, baruch_shapes
from cvxupdate.direct.berman_nagy import berman_mass, berman_nagy
from cvxupdate.direct.caesar import caesar
from cvxupdate.direct.error_matrix import (
    flexibility,
    gysin,
    lieven_ewins,
    second_order,
    sidhu_ewins,
)
from cvxupdate.direct.fuh_chen import fuh_chen
from cvxupdate.direct.inman_minas import inman_minas
from cvxupdate.direct.mixing import caesar_link, luk, ross, thoren
from cvxupdate.direct.placement import modal_control, pole_placement, single_input
from cvxupdate.direct.result import DirectUpdate, Faults, change_by_dof, faults, reproduced
from cvxupdate.direct.wei import wei
from cvxupdate.direct.weighted import error_deviation, he_ewins, park_lee

__all__ = [
    "DirectUpdate",
    "Faults",
    "baruch",
    "baruch_shapes",
    "berman_mass",
    "berman_nagy",
    "caesar",
    "caesar_link",
    "change_by_dof",
    "error_deviation",
    "faults",
    "flexibility",
    "fuh_chen",
    "gysin",
    "he_ewins",
    "inman_minas",
    "lieven_ewins",
    "luk",
    "minas_inman",
    "modal_control",
    "park_lee",
    "pole_placement",
    "reproduced",
    "ross",
    "second_order",
    "sidhu_ewins",
    "single_input",
    "symmetric_gain",
    "thoren",
    "wei",
    "zimmerman_widengren",
]
