"""Internal forces as the bench has them: from relative motion x (m), velocity v (m/s) and, with
memory, a force z (N) of its own."""

from __future__ import annotations

import math
from dataclasses import dataclass

MEMORY = ("jenkins", "bouc_wen")
EDGE = 0.01  # of the limit: where a slider begins to slide, so that its rate is continuous


@dataclass(frozen=True)
class Law:
    """``kind`` and its figures ``p``; ``rub`` is the velocity (m/s) within which dry friction turns
    over, far below any of the recordings."""

    kind: str
    p: tuple[float, ...]
    rub: float = 0.0

    @property
    def remembers(self) -> bool:
        """Whether it has a state."""
        return self.kind in MEMORY

    def force(self, x: float, v: float, z: float) -> float:
        """On the moving side, against its motion, N."""
        p = self.p
        match self.kind:
            case "cubic":
                return p[0] * x * x * x
            case "quadratic":
                return p[0] * x * x
            case "damping":
                return p[0] * v * abs(v)
            case "friction":
                return p[0] * math.tanh(v / self.rub)
            case "gap":  # towards the sign of the gap
                return p[0] * max(x - p[1], 0.0) if p[2] > 0.0 else p[0] * min(x + p[1], 0.0)
            case "play":
                return p[0] * (max(x - p[1], 0.0) + min(x + p[1], 0.0))
        return z

    def rate(self, v: float, z: float) -> float:
        """Of the state, N/s. Jenkins: a spring behind a slider, which begins to slide in the last
        hundredth of its force. Bouc and Wen with n = 2, β = γ."""
        k, limit = self.p
        u = z / limit if v > 0.0 else -z / limit  # 1 where it slides
        if self.kind == "jenkins":
            return k * v * min(1.0, max(0.0, (1.0 - u) / EDGE))
        return k * v * (1.0 - (u * u if u > 0.0 else 0.0))
