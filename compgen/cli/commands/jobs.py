"""Commands that write the files of a path: generate, predict."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.options.page_options import Labels, PageChoice, PageDate, PagePlace, page_date, page_place
from compgen.cli.output_files.figure_files import Content
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import REPORT, Headed, check_folder, resume_files
from compgen.cli.output_files.publish import publish
from compgen.cli.screen.messages import outside_words
from compgen.core import stages
from compgen.core.commands import Command
from compgen.core.dates import DEFAULT_DATE, checked_date
from compgen.core.finding_codes import Level
from compgen.core.findings import first_message
from compgen.core.stages import Progress
from compgen.core.units import MM

if TYPE_CHECKING:
    from compgen.pipelines.planned.job_results import Corrected, Planned

REPORTS = ("report.html", "waypoints.csv")


PredictFolder = Annotated[
    str | None, typer.Option("-o", "--output", help="Folder for the results; default outputs/<path name>_predict.")
]
PlannedProgram = Annotated[
    bool, typer.Option("--program", help="Write the planned program as well, named ..._PLAN: not corrected.")
]
HeaderDate = Annotated[
    str | None,
    typer.Option("--date", help="Date, YY-MM-DD, of the header (else 26-01-01) and of the page (else none)."),
]
Parted = Annotated[
    bool, typer.Option("--pages/--no-pages", help="Part a program that is more than the controller holds.")
]
LiftAll = Annotated[
    float | None,
    typer.Option("--lift-all", help="Write a dry run instead: the whole program lifted by so much [mm]."),
]


def generate(
    path: opt.PathFile,
    *,
    job: opt.JobChoice,
    output: opt.OutputFolder = None,
    date: HeaderDate = None,
    page: PageChoice,
    labels: Labels,
    force: opt.ForceProgram = False,
    pages: Parted = True,
    strict: opt.Strict = False,
    lift_all: LiftAll = None,
    max_um: opt.MaxUm = None,
    screen: opt.FindingScreen,
    cores: opt.CompiledCores,
) -> Outcome:
    """Write the corrected program and its proof.

    Examples:
        cgen generate paths/spiral_1300.toml -o out
        cgen generate paths/optic_raster.toml --set path.stepover_mm=2 --set before.0.duration_h=3
        cgen generate paths/optic_raster.toml --lift-all 50 -o dry
    """
    from compgen.cli.screen.job_table import job_shown
    from compgen.cli.screen.progress_bar import GENERATE, show_progress
    from compgen.pipelines.planned import generate as pipeline
    from compgen.pipelines.planned.assumed_ramps import judge_ramps
    from compgen.pipelines.planned.dry_run import lifted, naming_lift
    from compgen.pipelines.planned.program_text import program_name_of

    folder = opt.output_folder(path, output, "" if lift_all is None else "_dry")
    lift = None if lift_all is None else lift_all * MM
    with show_progress(GENERATE, quiet=screen.is_silent) as progress, naming_lift(lift):
        chosen = job.load(path, max_um)
        chosen = chosen if lift is None else lifted(chosen, lift)
        program = program_name_of(chosen)
        own = Headed(program=f"{program}.LS", header='= "compgen ', vouches=REPORTS)
        files = _job_files(page_place(folder, page, date, labels), Run(Command.GENERATE, chosen.name), program, [own])
        in_header = DEFAULT_DATE if date is None else checked_date(date)
        planned, corrected = pipeline.generate(chosen, progress, in_header, pages=pages)
        check_folder(folder, files.run, headed=[replace(own, program=f"{corrected.program.name}.LS")])
        corrected = judge_ramps(planned, corrected) if strict else corrected
        programs = dict(corrected.delivery.files) if corrected.is_usable or force else {}
        reports = files.put(planned, corrected, programs, progress)
    shown = job_shown(planned, corrected, folder, [*programs, *reports], verbose=screen.verbose)
    errors = [] if corrected.inside else [_why_not_inside(corrected, force=force)]
    return Outcome(record=reports[REPORT], shown=shown, errors=errors)


def _why_not_inside(corrected: "Corrected", *, force: bool) -> str:
    """Why a program is not inside its bounds, and whether it was written."""
    program = f"{corrected.program.name}.LS"
    ending = f"{program} not written; --force writes it"
    if corrected.is_as_planned:
        ending = f"{program} is written as planned"
    elif force:
        ending = "written all the same (--force)"
    return f"{outside_words(corrected.findings)}; {ending}"


def predict(
    path: opt.PathFile,
    *,
    job: opt.JobChoice,
    output: PredictFolder = None,
    max_um: opt.MaxUm = None,
    page: PageChoice,
    labels: Labels,
    date: PageDate = None,
    program: PlannedProgram = False,
    screen: opt.FindingScreen,
    cores: opt.CompiledCores,
) -> Outcome:
    """Predict the error of the planned program, without correcting it.

    Examples:
        cgen predict paths/spiral_1300.toml --set process.feed_mm_s=40
        cgen predict paths/spiral_1300.toml --program --max-um 150
    """
    from compgen.cli.screen.job_table import job_shown
    from compgen.cli.screen.progress_bar import PREDICT, show_progress
    from compgen.pipelines.planned import generate as pipeline
    from compgen.pipelines.planned.planned_delivery import COMMENT, deliver_planned, planned_name_of
    from compgen.pipelines.planned.program_text import program_name_of

    folder = opt.output_folder(path, output, "_predict")
    with show_progress(PREDICT, quiet=screen.is_silent) as progress:
        chosen = job.load(path, max_um)
        name = planned_name_of(chosen)
        corrected, own = f"{program_name_of(chosen)}.LS", Headed(program=f"{name}.LS", header=f'= "{COMMENT}"')
        run = Run(Command.PREDICT, chosen.name)
        files = _job_files(page_place(folder, page, date, labels), run, name, [Headed(program=corrected), own])
        planned = pipeline.predict(chosen, progress)
        programs: dict[str, bytes] = {}
        if program:
            planned, delivered = deliver_planned(planned, DEFAULT_DATE if date is None else page_date(date)[2:])
            programs = {} if first_message(Level.OUTSIDE, planned.findings) else dict(delivered.files)
        reports = files.put(planned, None, programs, progress)
    errors = opt.beyond_bound("predicted: error of {}", planned.deviation().on_part["total"].max, max_um)
    if program and not programs:
        errors = [f"{first_message(Level.OUTSIDE, planned.findings)}; {name}.LS not written"]
    shown = job_shown(planned, None, folder, [*programs, *reports], verbose=screen.verbose)
    return Outcome(record=reports[REPORT], shown=shown, errors=errors)


@dataclass(frozen=True, slots=True)
class JobOutput:
    """Where the files of a job go, and whose they are."""

    place: PagePlace
    run: Run
    program: str  # the name, also of the one that an earlier run left

    def put(
        self, planned: "Planned", corrected: "Corrected | None", programs: Mapping[str, bytes], progress: Progress
    ) -> dict[str, Content]:
        """Write programs and reports; an earlier run's program and pages go where this run writes none."""
        from compgen.program.pages import MANIFEST_SUFFIX
        from compgen.report.job_page import job_reports

        progress(stages.REPORT, 0.0)
        options, with_program = self.place.options, corrected is None or bool(programs)
        reports = self.place.files(job_reports(planned, corrected, options, with_program=with_program))
        contents = {
            name: _with_progress(content, progress, 0.6 + 0.4 * k / len(reports))
            for k, (name, content) in enumerate(reports.items())
        }
        own_names = {f"{self.program}.LS", *resume_files(self.place.folder)}
        publish(self.place.folder, programs, contents, own_names, f"{self.program}{MANIFEST_SUFFIX}", self.run)
        return reports


def _job_files(place: PagePlace, run: Run, program: str, headed: Sequence[Headed]) -> JobOutput:
    """Where the files of a job go; raises InputError where they would replace what is not the run's own."""
    check_folder(place.folder, run, record=REPORT, others=REPORTS, headed=headed)
    return JobOutput(place, run, program)


def _with_progress(content: Content, progress: Progress, share: float) -> Iterable[bytes]:
    for block in [content] if isinstance(content, bytes) else content:
        progress(stages.REPORT, share)
        yield block
