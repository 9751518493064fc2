"""The command that varies anything, and answers what people ask of a path's warmth."""

import sys
from typing import Annotated, Any

import typer

from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_keys, complete_paths, complete_questions
from compgen.cli.options.page_options import Assets, AssetsOption, PageDate, page_files, page_options
from compgen.cli.output_files import study_journal
from compgen.cli.output_files.figure_files import FiguresOption
from compgen.cli.output_files.publish import publish
from compgen.cli.output_files.study_folder import QUESTIONS, RECORD, own_files, study_folder
from compgen.cli.screen.console import finding_lines
from compgen.cli.screen.messages import print_error, print_record
from compgen.core.findings import beyond_text


def whatif(
    path: opt.PathFile,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary", autocompletion=complete_keys, help="KEY=V1,V2,... or KEY=FROM:TO:COUNT; repeat for a grid."
        ),
    ] = None,
    scenario_list: Annotated[
        str | None, typer.Option("--list", help="CSV with keys as header, a scenario a row.")
    ] = None,
    correct: Annotated[bool, typer.Option("--correct", help="Correct and prove each scenario as well.")] = False,
    questions: Annotated[
        list[str] | None,
        typer.Option("--ask", autocompletion=complete_questions, help=f"{', '.join(QUESTIONS)}; repeatable."),
    ] = None,
    within_um: Annotated[float, typer.Option("--within-um", help="The X of the questions [um].")] = 5.0,
    pass_paths: Annotated[
        list[str] | None,
        typer.Option("--pass", autocompletion=complete_paths, help="Path files, for passes."),
    ] = None,
    feeds: Annotated[str | None, typer.Option("--feeds", help="Feeds for passes, mm/s: 20,100,200.")] = None,
    cluster: Annotated[
        str | None,
        typer.Option(
            "--cluster",
            help="A Dask scheduler's address; it is trusted (pickles go both ways); tls:// by Dask's settings.",
        ),
    ] = None,
    live: Annotated[
        bool, typer.Option("--live/--no-live", help="Sliders on the page; they take one corrected program.")
    ] = True,
    fresh: Annotated[bool, typer.Option("--fresh", help="Forget finished scenarios of an earlier run.")] = False,
    robot: opt.JobRobot = None,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder for the results; default outputs/<path name>_whatif.")
    ] = None,
    overrides: opt.Overrides = None,
    state: opt.StateFile = None,
    state_age: opt.StateAge = None,
    max_um: opt.MaxUm = None,
    as_json: opt.Json = False,
    assets: AssetsOption = Assets.INLINE,
    figures: FiguresOption = None,
    date: PageDate = None,
    quiet: opt.Quiet = False,
    workers: opt.Workers = 0,
) -> None:
    """Move the day with sliders; vary any key, predict (and correct) every scenario, answer questions."""
    from compgen.cli.commands.live import sliders
    from compgen.cli.commands.study_run import run_scenarios
    from compgen.core.exceptions import InputError
    from compgen.core.units import UM
    from compgen.pipelines.study import build
    from compgen.pipelines.study.questions import answer_questions, base_job, check_study
    from compgen.report.files import study_files, study_sentences
    from compgen.report.live import NONE

    overrides = opt.with_state(path, opt.with_bound(overrides, max_um if correct else None), state, state_age)
    opt.checked_bound(max_um)
    if max_um is not None and not (vary or scenario_list):
        raise InputError(f"--max-um {max_um:g}: no scenario to judge; give --vary KEY=V1,V2 or --list FILE.csv")
    check_study(questions or [], within_um, varied=bool(vary or scenario_list) or live)
    study = build(path, robot, overrides, vary or (), scenario_list, correct=correct) if vary or scenario_list else None
    folder = opt.output_folder(path, output, "_whatif")
    identity = study.identity if study else None
    folder = study_folder(folder, path, identity, set(questions or []), output is not None, fresh)
    of_page = page_options(folder, assets, date)
    answers = answer_questions(path, robot, overrides, questions or [], within_um * UM, pass_paths or [], feeds)
    rows = run_scenarios(study, folder, workers, cluster, fresh, quiet or as_json) if study else []
    living = sliders(path, robot, overrides, quiet or as_json, study is None and not answers) if live else NONE
    journal = {study_journal.NAME: study_journal.content(study.identity, rows)} if study else {}
    base = base_job(path, robot, overrides)
    files = study_files(
        path, overrides, study, rows=rows, answers=answers, base=base, options=of_page, live=living, max_um=max_um
    )
    reports = page_files(folder, files, figures, of_page)
    publish(folder, journal, reports, own_files() if fresh else ())
    if as_json:
        print_record(files[RECORD])
    elif not quiet:
        sys.stdout.write("".join(f"{sentence}\n" for sentence in study_sentences(study, rows, answers)))
        sys.stdout.write(f"{living.sentence}\n" if living.sentence else "")
        for line in finding_lines(base.input_findings if base is not None else ()):
            sys.stdout.write(f"{line}\n")
        for row in [row for row in rows if row["state"] == "failed"][:10]:
            sys.stdout.write(f"failed: scenario {row['index']}: {row['reason']}\n")
        sys.stdout.write(f"wrote {', '.join(sorted([*journal, *files]))} to {folder}\n")
    if rows and all(row["state"] == "failed" for row in rows):
        raise typer.Exit(print_error(f"every scenario failed: {rows[0]['reason']}", 1))
    if max_um is not None and rows:
        _judge(rows, max_um)


def _judge(rows: list[dict[str, Any]], max_um: float) -> None:
    """Exit 1 where a scenario's error is beyond the bound, corrected where it was, or is not known."""
    failed = next((row for row in rows if row["state"] == "failed"), None)
    if failed is not None:
        raise typer.Exit(print_error(f"scenario {failed['index']} failed: {failed['reason']}", 1))
    outside = next((row for row in rows if not row.get("inside", True)), None)
    if outside is not None:
        raise typer.Exit(print_error(f"scenario {outside['index']}: {outside['reason']}", 1))
    worst = max(rows, key=lambda row: row["before_on_part_max_um"])
    if "inside" not in worst and worst["before_on_part_max_um"] > max_um:
        size = beyond_text(worst["before_on_part_max_um"], max_um)
        message = f"scenario {worst['index']}: {size} um uncorrected, --max-um {max_um:g}"
        raise typer.Exit(print_error(message, 1))
