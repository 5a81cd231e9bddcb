"""The command line of the commands in this room."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cvxupdate.commands.shared import Json, Out, Problem, display, say
from cvxupdate.report.files import folder_for, must_be_writable, write_files

Recorded = Annotated[
    Path,
    typer.Argument(
        metavar="PROBLEM|FILE",
        help="a problem file, a TOML file of recordings alone, or a file of recordings",
        show_default=False,
    ),
]
Method = Annotated[
    str,
    typer.Option(
        "--method", help="plscf, realisation, ibrahim, appropriation; ssi: responses alone"
    ),
]
Normal = Annotated[
    str | None,
    typer.Option(
        "--normal",
        help="realise complex modes to normal ones: simple, rotation, mac, niedbal, ibrahim, "
        "ibrahim-fill, zhang-lallement, wei-zhang, ibrahim-fullekrug, normal-frf, resonance, "
        "crossings, or all",
        show_default=False,
    ),
]
Band = Annotated[
    tuple[float, float] | None,
    typer.Option("--band", help="lowest and highest frequency, Hz", show_default=False),
]
Order = Annotated[int, typer.Option("--order", help="largest order of the diagram")]
Which = Annotated[
    str | None,
    typer.Option("--recording", help="one of several, by number or name", show_default=False),
]
Rate = Annotated[
    float | None,
    typer.Option(
        "--rate", help="sampling rate, Hz, of a file that states none", show_default=False
    ),
]
Damping = Annotated[str, typer.Option("--damping", help="viscous or hysteretic")]
Estimator = Annotated[
    str | None,
    typer.Option(
        "--estimator",
        help="of frequency responses from time histories: lpm, h1, h2 or hv",
        show_default=False,
    ),
]
Decay = Annotated[
    float, typer.Option("--decay", help="1/s, exponential window to take out of the damping")
]
Indicator = Annotated[
    str,
    typer.Option(
        "--indicator",
        help="of force appropriation: asher, modified-asher, traill-nash, extended-asher, mmif, "
        "nash",
    ),
]

Sensors = Annotated[
    int | None,
    typer.Option("--sensors", help="how many; default half as many again as modes"),
]
Exciters = Annotated[
    int | None,
    typer.Option("--exciters", help="how many; default the fewest that drive and separate"),
]
Modes = Annotated[int, typer.Option("--modes", help="how many modes, from the lowest")]
Noise = Annotated[
    float | None,
    typer.Option(
        "--noise", help="of the responses to come, a fraction (0.01; beside a diagnosis as it was)"
    ),
]
Accuracy = Annotated[float, typer.Option("--accuracy", help="wanted of parameters, a fraction")]

Told = Annotated[
    Path | None,
    typer.Option(
        "--diagnosis",
        help="a diagnosis.json with equivalents: what would tell them apart",
        show_default=False,
    ),
]

Further = Annotated[
    int | None,
    typer.Option(
        "--further",
        help="with --diagnosis: how many responses are to tell its explanations apart together; "
        "default as many as are worth it",
        show_default=False,
    ),
]

Shown = Annotated[int, typer.Option("--modes", help="how many modes, from the lowest")]
Kind = Annotated[
    str,
    typer.Argument(
        metavar="KIND", help="beam, frame, plate, matrices or chain", show_default=False
    ),
]
Folder = Annotated[
    Path,
    typer.Argument(metavar="DIR", help="a folder that is empty or not there", show_default=False),
]


def identify(
    source: Recorded,
    out: Out = None,
    as_json: Json = False,
    method: Method = "plscf",
    normal: Normal = None,
    band: Band = None,
    order: Order = 60,
    recording: Which = None,
    rate: Rate = None,
    damping: Damping = "viscous",
    estimator: Estimator = None,
    decay: Decay = 0.0,
    indicator: Indicator = "mmif",
) -> None:
    """Identify modes from recordings: frequencies, damping, shapes, with their deviations."""
    from cvxupdate.commands.identify import Options
    from cvxupdate.commands.identify import identify as do
    from cvxupdate.report.identify_files import identify_files
    from cvxupdate.report.identify_page import identify_text
    from cvxupdate.spec.problem import name_of

    must_be_writable(out)
    options = Options(
        method, normal, band, order, recording, rate, damping, estimator, decay, indicator
    )
    with display(as_json) as show:
        found = do(source, options, None if show is None else show.read)
    folder = folder_for(out, name_of(source), "identify")
    files, payload = identify_files(found)
    write_files(folder, files)
    say(payload, as_json, lambda: identify_text(found, folder))


def plan(
    problem: Problem,
    out: Out = None,
    as_json: Json = False,
    sensors: Sensors = None,
    exciters: Exciters = None,
    modes: Modes = 6,
    band: Band = None,
    noise: Noise = None,
    accuracy: Accuracy = 0.05,
    diagnosis: Told = None,
    further: Further = None,
) -> None:
    """Plan a measurement from the model alone: sensors, exciters, lines, accuracy; or what would
    tell the explanations of a diagnosis apart."""
    from cvxupdate.commands.plan import plan as do
    from cvxupdate.commands.planned import Diagnosed, Options
    from cvxupdate.report.plan_page import plan_files, plan_text
    from cvxupdate.spec import name_of

    must_be_writable(out)
    options = Options(sensors, exciters, modes, band, noise, accuracy, further)
    told = None if diagnosis is None else Diagnosed.of(diagnosis)
    with display(as_json) as show:
        found = do(problem, options, told, None if show is None else show.say)
    folder = folder_for(out, name_of(problem), "plan")
    files, payload = plan_files(found)
    write_files(folder, files)
    say(payload, as_json, lambda: plan_text(found, folder))


def view(problem: Problem, out: Out = None, as_json: Json = False, modes: Shown = 6) -> None:
    """Show a problem before anything is solved: structure, supports, sensors, first modes."""
    from cvxupdate.commands.view import view as do
    from cvxupdate.report.view_page import view_files, view_text
    from cvxupdate.spec import name_of

    must_be_writable(out)
    found = do(problem, modes)
    folder = folder_for(out, name_of(problem), "view")
    files, payload = view_files(found)
    write_files(folder, files)
    say(payload, as_json, lambda: view_text(found, folder))


def new(kind: Kind, folder: Folder) -> None:
    """Make a folder with a problem that runs, to be changed into your own."""
    from cvxupdate.commands.new import new as do

    names = do(kind, folder)
    print(f"{folder}: {', '.join(names)}.\nNext: cvxupdate view {folder / 'problem.toml'}")


def add(app: typer.Typer) -> None:
    """Makes the commands of this room known."""
    app.command()(identify)
    app.command()(plan)
    app.command()(view)
    app.command()(new)
