"""What a column's name says that it holds of a complex number."""

from __future__ import annotations

import re

_ROLES = (
    ("coherence", r"coherence|coher|coh|gamma2?|γ²?"),
    ("imaginary", r"imaginary|imag|im"),
    ("real", r"real|re"),
    ("decibel", r"decibels?|db"),
    ("phase", r"phase|phi|angle|arg|ang"),
    ("magnitude", r"magnitude|modulus|amplitude|mag|ampl|amp|abs"),
)
PARTNER = {"real": "imaginary", "magnitude": "phase", "decibel": "phase"}
"""What stands beside a column of each kind."""
FORM = {"real": "real-imaginary", "magnitude": "magnitude-phase", "decibel": "db-phase"}
"""The form of a channel whose first column is of each kind."""


def role_of(name: str, unit: str) -> tuple[str, str]:
    """What a column holds of a complex number ("": not said), and its name without that word."""
    for role, words in _ROLES:
        found = re.search(rf"(?<![A-Za-z])({words})(?![A-Za-z])", name, re.IGNORECASE)
        if found is not None:
            rest = name[: found.start()] + " " + name[found.end() :]
            rest = re.sub(r"[\s_()\[\]|:.-]+", " ", re.sub(r"\b(deg|rad|dB)\b", "", rest))
            if role == "magnitude" and "db" in unit.lower():
                role = "decibel"
            return role, rest.strip()
    if unit.lower() in ("deg", "°", "rad"):
        return "phase", name.strip()
    return ("decibel", name.strip()) if "db" in unit.lower() else ("", name.strip())
