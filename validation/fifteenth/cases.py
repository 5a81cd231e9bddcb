"""All cases."""

from __future__ import annotations

from validation.fifteenth.cases_frf import frf_cases
from validation.fifteenth.cases_modes import modes_cases
from validation.fifteenth.cases_ref import ref_cases
from validation.fifteenth.shapes import Case


def every_case() -> list[Case]:
    """Every case, by name."""
    return frf_cases() + modes_cases() + ref_cases()
