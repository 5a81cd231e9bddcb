"""Pages in a real browser (Debian's chromium, driven by playwright): nothing runs over the edge, on
a telephone or on a screen, in the light, in the dark and on paper."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from cvxupdate.beside import beside
from cvxupdate.cli import app
from cvxupdate.report.diagnosis import diagnosis_files
from cvxupdate.study import open_problem
from tests.commands.test_plan import BEAM, UPDATE
from tests.report.test_diagnosis import FOUND, SHOWN
from tests.test_beside import PORTAL, found
from tests.test_cli import CHAIN

CHROMIUM = shutil.which("chromium")
WIDTHS = (420, 768, 1280)
OVER = """() => [...document.querySelectorAll('main *')].filter(e => {
  if (e.closest('svg') && e.tagName !== 'svg') return false;
  for (let p = e.parentElement; p; p = p.parentElement)
    if (['auto', 'scroll'].includes(getComputedStyle(p).overflowX)) return false;
  const r = e.getBoundingClientRect();
  return r.width > 0 && (r.right > innerWidth + 1 || r.left < -1);
}).map(e => e.tagName + ' ' + e.textContent.slice(0, 40))"""
SEEN = """() => [...document.querySelectorAll('figure svg')].map(e => {
  const r = e.getBoundingClientRect(); return [r.width, r.height]; })"""
CONTRAST = """() => {
  const light = c => { const v = c.match(/[0-9.]+/g).slice(0, 3).map(x => x / 255).map(
    x => x <= 0.03928 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
    return 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2]; };
  const under = e => { for (let p = e; p; p = p.parentElement) {
    const b = getComputedStyle(p).backgroundColor; if (!/, 0\\)$/.test(b)) return b; }
    return 'rgb(255, 255, 255)'; };
  return [...document.querySelectorAll('p, li, td, th, dt, dd, h1, h2, h3, figcaption, code, pre')]
    .filter(e => e.textContent.trim()).map(e => { const a = light(getComputedStyle(e).color),
      b = light(under(e)); return [(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05),
      e.textContent.slice(0, 40)]; }).filter(x => x[0] < 4.5); }"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("chromium is not installed: pages are not tested in a browser")
    with api.sync_playwright() as play:
        opened = play.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """A page of `diagnose` with everything on it, by name its file."""
    folder = tmp_path_factory.mktemp("pages")
    opened = open_problem(PORTAL)
    told = found(PORTAL, 1.1)
    F = SHOWN.curves[0].frequency
    turning = tuple(np.mod(k + 3.0 * F, 360.0) - 180.0 for k in (0.0, 20.0, 5.0))
    shown = replace(SHOWN, curves=(replace(SHOWN.curves[0], phases=turning),))
    full = replace(
        told,
        shown=shown,
        beside=beside(*opened, told),
        candidates=FOUND.candidates * 12,
        evidence=("A line with a number, 4.8e-09, and " + "words " * 40,) * 4,
    )
    texts = {
        "diagnosis": diagnosis_files(full, opened[0])[0]["report.html"],
        "nothing": diagnosis_files(
            replace(full, findings=(), updated=None, verdict="consistent"), opened[0]
        )[0]["report.html"],
    }
    texts |= of_commands(folder)
    out = {}
    for name, text in texts.items():
        (folder / f"{name}.html").write_text(text, encoding="utf-8")
        out[name] = (folder / f"{name}.html").as_uri()
    return out


def of_commands(folder: Path) -> dict[str, str]:
    """The pages of the other commands, as they write them."""
    (folder / "chain.toml").write_text(CHAIN, encoding="utf-8")
    (folder / "plan.toml").write_text(BEAM + UPDATE, encoding="utf-8")
    rng, f = np.random.default_rng(2), np.linspace(5.0, 60.0, 300)
    s = 2j * np.pi * f
    H = sum(k / (s**2 + 0.02 * w * s + w**2) for k, w in ((1.0, 100.0), (-0.4, 240.0)))
    H = s**2 * H * (1.0 + 0.01 * rng.standard_normal(len(f)))
    table = np.column_stack([f, np.real(H), np.imag(H)])
    np.savetxt(folder / "frf.csv", table, delimiter=",", header="frequency,real,imag", comments="")
    words = {
        "run": ["run", "chain.toml"],
        "solvers": ["solvers", "chain.toml"],
        "correlate": ["correlate", str(PORTAL)],
        "view": ["view", str(PORTAL), "--modes", "2"],
        "plan": ["plan", "plan.toml", "--modes", "3", "--sensors", "4"],
        "identify": ["identify", "frf.csv"],
    }
    out = {}
    for name, asked in words.items():
        with contextlib.chdir(folder):
            ran = CliRunner().invoke(app, [*asked, "--out", name])
        assert ran.exit_code == 0, ran.output
        out[name] = (folder / name / "report.html").read_text(encoding="utf-8")
    return out


PAGES = ["diagnosis", "nothing", "run", "solvers", "correlate", "view", "plan", "identify"]


@pytest.mark.parametrize("name", PAGES)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nothing_runs_over_the_edge_and_everything_can_be_read(
    browser: Any, pages: dict[str, str], name: str, scheme: str
) -> None:
    context = browser.new_context(color_scheme=scheme)
    page = context.new_page()
    page.goto(pages[name])
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": 900})
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert page.evaluate(OVER) == []
        assert all(w > 100 and h > 30 for w, h in page.evaluate(SEEN))
    assert page.evaluate(CONTRAST) == []
    context.close()


def test_text_in_figures_is_text_and_shapes_move(browser: Any, pages: dict[str, str]) -> None:
    page = browser.new_page()
    page.goto(pages["diagnosis"])
    assert page.evaluate("[...document.querySelectorAll('svg text')].length") > 20
    assert page.evaluate("document.querySelectorAll('.moving svg animate').length") > 3
    assert page.evaluate("document.querySelectorAll('script').length") == 0
    page.close()


def test_paper_keeps_figures_whole(browser: Any, pages: dict[str, str], tmp_path: Path) -> None:
    page = browser.new_page()
    page.goto(pages["diagnosis"])
    page.pdf(path=str(tmp_path / "p.pdf"), format="A4")
    assert (tmp_path / "p.pdf").read_bytes().startswith(b"%PDF")
    page.emulate_media(media="print")
    breaks = page.evaluate(
        "[...document.querySelectorAll('figure')].map(e => getComputedStyle(e).breakInside)"
    )
    assert breaks and set(breaks) == {"avoid"}
    page.close()


@pytest.mark.parametrize("name", PAGES)
def test_axe_finds_nothing_serious(browser: Any, pages: dict[str, str], name: str) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    page = browser.new_page()
    page.goto(pages[name])
    found_ = axe.Axe().run(page).response["violations"]
    serious = [v for v in found_ if v["impact"] in ("serious", "critical")]
    assert [(v["id"], v["nodes"][0]["html"][:120]) for v in serious] == []
    page.close()
