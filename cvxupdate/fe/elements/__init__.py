"""Element types, one small file each. To add one: a file, a class, its line here, an instance in
tests/cases/."""

from cvxupdate.fe.elements.base import Element, Term
from cvxupdate.fe.elements.beam2d import Beam2D
from cvxupdate.fe.elements.beam3d import Beam3D
from cvxupdate.fe.elements.bouc_wen import BoucWen
from cvxupdate.fe.elements.clearance import Clearance
from cvxupdate.fe.elements.cubic_spring import CubicSpring
from cvxupdate.fe.elements.dashpot import Dashpot
from cvxupdate.fe.elements.exact_beam import ExactBeam3D
from cvxupdate.fe.elements.friction import Friction
from cvxupdate.fe.elements.gyroscopic import Gyroscopic
from cvxupdate.fe.elements.hex8 import Hex8
from cvxupdate.fe.elements.hex20 import Hex20
from cvxupdate.fe.elements.iwan import Iwan
from cvxupdate.fe.elements.jenkins import Jenkins
from cvxupdate.fe.elements.mass import Mass
from cvxupdate.fe.elements.matrix import Entries
from cvxupdate.fe.elements.plate import Plate
from cvxupdate.fe.elements.quadratic_damper import QuadraticDamper
from cvxupdate.fe.elements.rod import Rod
from cvxupdate.fe.elements.shell import Shell
from cvxupdate.fe.elements.spring import Spring
from cvxupdate.fe.elements.tet10 import Tet10

LINEAR = (
    Spring,
    Mass,
    Dashpot,
    Gyroscopic,
    Rod,
    Beam2D,
    Beam3D,
    ExactBeam3D,
    Plate,
    Shell,
    Hex8,
    Hex20,
    Tet10,
    Entries,
)
NONLINEAR = (CubicSpring, Clearance, Friction, Jenkins, Iwan, BoucWen, QuadraticDamper)
ELEMENTS = (*LINEAR, *NONLINEAR)

__all__ = [
    "ELEMENTS",
    "Beam2D",
    "Beam3D",
    "Dashpot",
    "Element",
    "Entries",
    "Gyroscopic",
    "Hex8",
    "Hex20",
    "Mass",
    "Plate",
    "Rod",
    "Shell",
    "Spring",
    "Term",
    "Tet10",
]
