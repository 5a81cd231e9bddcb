"""The figures that the contract asks of an effect, from the unknowns that were fitted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import Parameter

FAINT = 1e-6  # responses that seem so many times too small: as good as none
Figure = tuple[float, float]
Conversion = Callable[[Model, Parameter | None, float, float, float], Figure]


@dataclass(frozen=True)
class Quantity:
    """A figure: its ``name`` in the contract, which unknown of the effect it is made of, how, the
    value at which there is no effect (None: that is no number, as with a rigid joint), its SI
    ``unit``."""

    name: str
    index: int
    convert: Conversion
    nothing: float | None
    unit: str = ""

    def value(
        self, model: Model, parameter: Parameter | None, x: float, dx: float, unit: float = 1.0
    ) -> Figure:
        """(value, deviation) of an unknown ``x`` with deviation ``dx``; ``parameter`` is its own on
        ``model`` (None: a channel's), ``unit`` the seconds of a delay of 1."""
        return self.convert(model, parameter, x, dx, unit)


def factor(name: str = "factor", index: int = 0) -> Quantity:
    """1 + x: of a property, or the gain of a channel."""
    return Quantity(name, index, lambda model, parameter, x, dx, unit: (1.0 + x, dx), 1.0)


def inverse(name: str) -> Quantity:
    """1 / (1 + x): the gain of a force channel, by which responses seem too small."""

    def convert(m: Model, q: Parameter | None, x: float, dx: float, unit: float) -> Figure:
        seen = x + 1.0 if abs(x + 1.0) > FAINT else FAINT
        return 1.0 / seen, dx / seen**2

    return Quantity(name, 0, convert, 1.0)


def physical(name: str, unit: str, index: int = 0) -> Quantity:
    """The parameter's value in SI units."""
    return Quantity(name, index, _physical, 0.0, unit)


def stiffness(name: str, unit: str, rigid: float, index: int = 0, times: float = 1.0) -> Quantity:
    """Of a spring that is given by its compliance, beside ``rigid`` where it stands for none; or of
    one so many ``times`` as stiff."""

    def convert(m: Model, q: Parameter | None, x: float, dx: float, unit: float) -> Figure:
        size = _of(q, name).unit_size
        compliance = rigid + size * x
        return times / compliance, times * size * dx / compliance**2

    return Quantity(name, index, convert, None, unit)


def shear_coefficient(name: str) -> Quantity:
    """That of the model's sections over x, the part of the flexibility in shear that acts."""
    return Quantity(name, 0, _kappa, None)


def delay(name: str) -> Quantity:
    """In units of the fault, s."""
    return Quantity(name, 0, lambda model, q, x, dx, unit: (x * unit, dx * unit), 0.0, "s")


def _physical(m: Model, q: Parameter | None, x: float, dx: float, unit: float) -> Figure:
    q = _of(q, "a value")
    return q.physical(x), abs(q.unit_size) * dx


def _kappa(model: Model, q: Parameter | None, x: float, dx: float, unit: float) -> Figure:
    given = [float(b.properties["kappa"][0]) for b in model.blocks if "kappa" in b.properties]
    kappa, size = max(given, default=5.0 / 6.0), max(x, 1e-6)
    return kappa / size, kappa * dx / size**2


def _of(parameter: Parameter | None, name: str) -> Parameter:
    if parameter is None:
        raise ModelError(f"{name} is the figure of a parameter of the model, and none was given.")
    return parameter
