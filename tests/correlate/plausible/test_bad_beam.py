"""The strangers' beam with one mistake in each: one warning that asks the right question, or one
error; and none for the sound one."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cvxupdate import study
from cvxupdate.errors import InputError, RecordingError
from cvxupdate.report.files import folder_for
from tests.cases.bad_beam import channels, csv_text, good_table, good_text, uff_text, write

TABLE = good_table()
GOOD = good_text()


def scaled(factor: float, columns: slice = slice(1, None)) -> str:
    table = TABLE.copy()
    table[:, columns] *= factor
    return csv_text(table)


def replaced(old: str, new: str) -> Callable[[str], str]:
    def change(text: str) -> str:
        assert old in text
        return text.replace(old, new)

    return change


def said(path: Path) -> list[str]:
    return [w["says"] for w in study.check(path)["warnings"]]  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("recording", "text"),
    [
        (channels(), GOOD),
        (channels(more=', unit = "g"'), scaled(1.0 / 9.80665)),
        (channels(more=', unit = "mm/s^2"'), scaled(1e3)),
    ],
)
def test_a_sound_recording_is_not_doubted(tmp_path: Path, recording: str, text: str) -> None:
    assert said(write(tmp_path, recording, text)) == []


SWAPPED = (5, 9, 13, 21, 17)

MISTAKES = {
    "g": (channels(), scaled(1.0 / 9.80665), str, r"9\.807 times too small.*in g\?"),
    "not in g": (
        channels(more=', unit = "g"'),
        GOOD,
        str,
        r"9\.807 times too large.*in m/s², and not in g\?",
    ),
    "mm": (channels(), scaled(1e3), str, r"1000 times too large.*in mm .*force in kN\?"),
    "inches": (channels(), scaled(1.0 / 0.0254), str, r"39\.37 times too large.*in inches"),
    "lbf": (channels(), scaled(4.4482216), str, r"4\.448 times too large.*force in lbf\?"),
    "kHz": (channels(), scaled(1e-3, slice(0, 1)), str, r"1000 times too low.*axis in kHz\?"),
    "rad/s": (
        channels(),
        scaled(2.0 * np.pi, slice(0, 1)),
        str,
        r"6\.283 times too high.*axis in rad/s\?",
    ),
    "displacement": (
        channels(quantity="displacement").replace("acceleration", "displacement"),
        GOOD,
        replaced('response = "acceleration"', 'response = "displacement"'),
        r"is it an acceleration, and not a displacement\?",
    ),
    "MPa": (channels(), GOOD, replaced("210e9", "210e3"), r"1/1000 of the measured.*E in MPa\?"),
    "GPa": (channels(), GOOD, replaced("210e9", "210.0"), r"of the measured.*E in GPa\?"),
    "g/cm3": (
        channels(),
        GOOD,
        replaced("rho = 7850", "rho = 7.85"),
        r"31\.6 times the measured.*density in g/cm³\?",
    ),
    "sections in mm": (
        channels(),
        GOOD,
        replaced("width = 0.008, height = 0.04", "width = 8, height = 40"),
        r"times the measured.*sections in mm\?",
    ),
    "side": (
        channels(),
        GOOD,
        replaced("width = 0.008, height = 0.04", "width = 0.04, height = 0.008"),
        r"5 times the measured.*on its side .*0\.04/0\.008 = 5\)",
    ),
    "turned": (
        channels(),
        scaled(-1.0, slice(5, 7)),
        str,
        r"channel n13\.y reads the wrong way round",
    ),
    "exchanged": (channels(SWAPPED), GOOD, str, r"n17\.y and n21\.y seem to be exchanged"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_each_mistake_is_asked_about_alone(tmp_path: Path, name: str) -> None:
    recording, text, change, words = MISTAKES[name]
    warnings = said(write(tmp_path, recording, text, change=change))
    assert len(warnings) == 1, warnings
    assert re.search(words, warnings[0]), warnings[0]


def test_coordinates_in_millimetres(tmp_path: Path) -> None:
    path = write(tmp_path, channels(), GOOD)
    rows = (tmp_path / "nodes.csv").read_text().splitlines()
    moved = [f"{i},{1e3 * float(x)}" for i, x in (row.split(",") for row in rows[1:])]
    (tmp_path / "nodes.csv").write_text("\n".join([rows[0], *moved]) + "\n")
    (warning,) = said(path)
    assert warning.endswith("are the coordinates of the nodes in mm?")


def test_a_direction_that_the_file_has_wrong(tmp_path: Path) -> None:
    text = uff_text(TABLE, dofs=(2, 2, -2, 2, 2))
    (warning,) = said(write(tmp_path, "", text, "beam.uff"))
    assert "channel n13.y reads the wrong way round" in warning


UPDATE = """
[update]
method = "rfm"
parameters = [{ elements = "all", of = "stiffness", lower = -0.2, upper = 0.2 }]
"""


@pytest.mark.parametrize("command", ["check", "correlate", "run", "diagnose"])
def test_a_dead_channel_is_refused_by_every_command(tmp_path: Path, command: str) -> None:
    text = scaled(0.0, slice(5, 7))
    path = write(tmp_path, channels(), text)
    with path.open("a", encoding="utf-8") as file:
        file.write(UPDATE)
    with pytest.raises(RecordingError, match=r"channel n13\.y .* reads 0 throughout: it is dead"):
        getattr(study, command)(path)
    if command == "check":
        (line,) = said(write(tmp_path, 'damaged = "leave-out"\n' + channels(), text))
        assert "channel n13.y does not move: it was left out" in line


def test_values_of_zero_amid_others_are_said(tmp_path: Path) -> None:
    table = TABLE.copy()
    table[9, 3:5] = 0.0
    (line,) = said(write(tmp_path, channels(), csv_text(table)))
    assert "n9.y" in line and "exactly 0 at 1 line" in line and "4.25 Hz" in line


def test_warnings_come_before_the_work_and_stand_in_the_result(tmp_path: Path) -> None:
    path = write(tmp_path, channels(), scaled(1.0 / 9.80665))
    heard: list[str] = []
    found = study.correlate(path, warn=heard.append)
    assert heard == [w.says for w in found.warnings] and "in g?" in heard[0]


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda text: text.replace(f"{9:10d}   2", f"{9:10d}   3"), r"add 'z' to model\.dofs"),
        (lambda text: text.replace("   2\n", "   0\n"), r"has no direction\. Export it with"),
        (lambda text: text.replace(f"{5:10d}", f"{105:10d}"), r"has no node 105.*node_map"),
    ],
)
def test_places_that_the_model_does_not_have(
    tmp_path: Path, spoil: Callable[[str], str], words: str
) -> None:
    path = write(tmp_path, "", spoil(uff_text(TABLE)), "beam.uff")
    with pytest.raises(InputError, match=f"(?i){words}"):
        study.check(path)


def test_every_command_has_a_folder_of_its_own(tmp_path: Path) -> None:
    """`correlate` then `diagnose` mixed in one."""
    commands = ("run", "correlate", "diagnose", "identify", "plan", "solvers", "view")
    assert len({folder_for(None, "beam", c) for c in commands}) == len(commands)
    assert folder_for(tmp_path, "beam", "run") == tmp_path


def test_a_channel_that_stands_twice_in_a_table_of_modes(tmp_path: Path) -> None:
    path = write(tmp_path, channels(), GOOD)
    text = path.read_text()
    table = """kind = "modes"
channels = [
  { column = 0, quantity = "acceleration", node = 9, dof = "y" },
  { column = 1, quantity = "acceleration", node = 17, dof = "y" },
  { column = 2, quantity = "acceleration", node = 9, dof = "y" },
]
rows = [{ frequency = 22.0, shape = [0.2, 0.7, 0.2] }]
"""
    path.write_text(text[: text.index('kind = "frf"')] + table)
    (warning,) = (w for w in said(path) if "channels" in w)
    assert "channels 1 and 3 are all acceleration at n9.y" in warning
