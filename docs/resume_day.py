"""Simulates a day of a 9 h job in pages, and writes its table and picture for docs/resume.md.

    python docs/resume_day.py

The arm of the day is not the one of the robot file: its law of warmth is off by about as much as the file says. It
starts 40 minutes late, stands in two breaks, and a door is opened. The job is driven three times: with the pages as
they were written before the day, with `cgen resume --log` before each page, and with `cgen follow --within-um 5`.
"""

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from compgen.cli.this_machine import use_machine
from compgen.core.units import HOUR, MINUTE, UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned import generate
from compgen.pipelines.planned.job_results import Planned
from compgen.pipelines.resume.beginning import Begun, read_rises
from compgen.pipelines.resume.follow import look_at
from compgen.pipelines.resume.page_times import PageMoment, PageTimes
from compgen.pipelines.resume.paged_run import planned_run
from compgen.pipelines.resume.pages_anew import page_steps, read_written
from compgen.pipelines.resume.rest import plan_whole
from compgen.pipelines.resume.result import size_of
from compgen.pipelines.resume.resume import resume
from compgen.pipelines.resume.written_job import job_of_pages, read_written_job
from compgen.program.pages import join_programs
from compgen.thermal import Ambient, state_after, states_at
from compgen.thermal.log_end import end_of
from compgen.thermal.temperature_log import read_growing_log
from compgen.verification.deviation import deviation_from_path
from compgen.verification.twin import prepare

HERE = Path(__file__).parent
ROOT = HERE.parent
NINE_HOURS = ("path.stepover_mm=2.25", "robot.controller.max_positions=2700")
LATE = 40 * MINUTE
BREAKS = ((5, 15 * MINUTE), (12, 45 * MINUTE))  # before these pages
DOOR = 4.5 * HOUR  # when it is opened: 2 K colder within 10 min, as warm as before an hour later
# of the day's arm against the file's: rises after the reference duty [K], time constants, an offset of all sensors
LAW_K = (0.5, 0.3, -0.6, 0.3, 0.2)
LAG = (1.1, 0.9, 0.9, 1.1, 1.0)
OFFSET_K, NOISE_K = 0.2, 0.1
WITHIN = 5 * UM
POLL = 2 * MINUTE
LEAD = 1 * MINUTE
TINTS = {"as written": "#c2410c", "resumed at each page": "#ca8a04", "followed": "#0f766e"}


def quiet(stage: str, share: float) -> None:
    """Progress of which nothing is said."""


@dataclass(frozen=True)
class Day:
    """What the cell does, whatever the pages say: the same for all three."""

    whole: Planned
    times: PageTimes
    air: Ambient  # on the log's clock
    rise: np.ndarray  # (N, K) [K] true, at each waypoint
    log: str  # CSV


def day_of(whole, written, breaks=BREAKS, door=DOOR) -> Day:
    """The true day of a job in pages."""
    run = planned_run(written, whole)
    spans = run.spans
    time, starts = LATE, []
    for page, span in enumerate(spans, 1):
        time += dict(breaks).get(page, 0.0)
        starts.append(PageMoment(time, page))
        time += span
    times = PageTimes(tuple(starts), spans, 0.0)
    air = Ambient(
        np.array([0.0, door, door + 10 * MINUTE, door + HOUR, door + 1.5 * HOUR]), np.array([0, 0, -2.0, -2.0, 0])
    )
    job, heat = whole.job, whole.job.heat
    true = replace(heat, reference_rise=heat.reference_rise + np.array(LAW_K), tau=heat.tau * np.array(LAG))
    z = state_after(true, job.history.before)
    rise, course = np.empty((len(whole.theta), len(true.names))), [(0.0, z)]
    for begin, end, page, _ in times.stretches(time):
        if page:
            motion, first = run.page_motion(page), run.edges[page - 1]
            rows = np.arange(len(motion.time))
            states = states_at(true, z, motion, rows, air, begin)
            rise[first : first + len(rows)] = states
            course += [(begin + t, s) for t, s in zip(motion.time.tolist(), states, strict=False)]
            z = states[-1]
        else:
            for t in np.linspace(begin, end, 20)[1:]:
                standing = [replace(job.history.standing, duration=float(t - begin))]
                course.append((float(t), state_after(true, standing, z, air, begin)))
            z = course[-1][1]
    return Day(whole, times, air, rise, _log(course, air, time, true.names, job.cell.sensors))


def _log(course, air, end, names, sensors) -> str:
    """Thermocouples every 30 s, with noise of a fixed seed and an offset."""
    time = np.arange(0.0, end + 30, 30.0)
    t, z = np.array([c[0] for c in course]), np.array([c[1] for c in course])
    noise = np.random.default_rng(9).normal(scale=NOISE_K, size=(len(time), len(sensors) + 1))
    columns = {"ambient_degC": 20 + air.at(time) + 0.3 * noise[:, -1]}
    for k, (part, node) in enumerate(sensors.items()):
        columns[f"{part}_degC"] = 20 + np.interp(time, t, z[:, names.index(node)]) + OFFSET_K + noise[:, k]
    rows = zip(time.tolist(), *(column.tolist() for column in columns.values()), strict=False)
    lines = [f"{row[0]:g}," + ",".join(f"{value:.2f}" for value in row[1:]) for row in rows]
    return "\n".join([f"time_s,{','.join(columns)}", *lines]) + "\n"


def until(log: str, time: float) -> bytes:
    """A log so far."""
    head, *rows = log.splitlines()
    return "\n".join([head, *(row for row in rows if float(row.partition(",")[0]) <= time)]).encode() + b"\n"


def left_on_the_part(day: Day, written):
    """Error of the pages in a folder by the twin, as warm as the day's arm, (M,) [m]; its path (M,) [m], its page."""
    whole = day.whole
    text, _ = join_programs(read_written(written, whole), page_steps(written))
    prepared = prepare(twin_of(whole.job), text, ()).with_rise(day.rise)
    deviation = deviation_from_path(whole.path, prepared.chunks(), prepared.sample_count)
    samples = prepared.first_samples()
    touching = np.append(np.repeat(whole.path.segments_on_part(), np.diff(samples)), False)
    page = np.searchsorted([samples[p.last] for p in written.pages], np.arange(len(touching)), side="left") + 1
    length = np.gradient(deviation.arc)
    return deviation.total()[touching], length[touching], page[touching]


def put(folder: Path, resumed) -> None:
    """New pages into their folder."""
    for name, data in resumed.files.items():
        (folder / name).write_bytes(data)


def resumed_at_each_page(day: Day, folder: Path) -> int:
    """`cgen resume --log` before each page; how often."""
    for start in day.times.starts:
        written = read_written_job(folder)
        file = folder / "so_far.csv"
        file.write_bytes(until(day.log, start.time))

        def begin(known, file=str(file)):
            log = read_rises(known.cell, known.logged(), file)
            state, air = (
                end_of(log, known.cell.heat, known.cell.warmth, known.motion).state,
                float(np.median(log.air[-20:])),
            )
            return Begun(cell=known.cell, state=state, clock=known.clock, why="log", cause={}, air=air)

        put(folder, resume(written, day.whole, start.page, begin, "2026-01-31", quiet))
    return len(day.times.starts)


def followed(day: Day, folder: Path, poll=POLL):
    """`cgen follow --within-um 5`: how often pages were written, and the forecast of each page when it began [m]."""
    end = day.times.starts[-1].time + day.times.duration[-1]
    run, count = planned_run(read_written_job(folder), day.whole), 0
    forecasts: dict[int, float] = {}
    for now in np.arange(poll, end, poll).tolist():
        known = tuple(start for start in day.times.starts if start.time <= now)
        times = replace(day.times, starts=known)
        job = day.whole.job
        log = read_growing_log("log.csv", job.heat.names, job.cell.sensors, data=until(day.log, now))
        look = look_at(run, log, "log.csv", times, WITHIN, 0, LEAD)
        if look is None:  # before the first reading
            continue
        if look.due and look.beginning is not None:
            done = times.last(now) - bool(look.running)
            made = run.rewrite(look.due, look.beginning, "2026-01-31", quiet, look.loaded, done)
            put(folder, made)
            run, count = run.reread(read_written_job(folder)), count + 1
            forecasts |= {page.number: page.after.max for page in made.pages}
        forecasts |= {f.page: f.max for f in look.forecasts if f.page > look.running and f.page != look.due}
    return count, forecasts


def simulate(overrides=NINE_HOURS, breaks=BREAKS, door=DOOR, poll=POLL):
    """The day, and its three runs: name to error (M,) [m], length (M,) [m], page (M,), times written anew."""
    job = load_job(str(ROOT / "paths" / "optic_raster.toml"), None, overrides)
    _, corrected = generate.generate(job, quiet)
    runs = {}
    with tempfile.TemporaryDirectory() as scratch:
        for name in TINTS:
            folder = Path(scratch) / name.replace(" ", "_")
            folder.mkdir()
            for file, data in corrected.delivery.files:
                (folder / file).write_bytes(data)
            written = read_written_job(folder)
            if name == "as written":
                whole = plan_whole(job_of_pages(written), quiet)
                day = day_of(whole, written, breaks, door)
            count = 0
            if name == "resumed at each page":
                count = resumed_at_each_page(day, folder)
            elif name == "followed":
                count, _ = followed(day, folder, poll)
            runs[name] = (*left_on_the_part(day, read_written_job(folder)), count)
    return day, runs


def share_within(error, length, bound=WITHIN) -> float:
    """Of the path on the part that keeps a bound."""
    return float(length[error <= bound].sum() / length.sum())


# The page ---------------------------------------------------------------------------------------------------------

PAGE, PICTURE, NUMBERS = HERE / "resume.md", HERE / "resume_day.svg", HERE / "resume_day.csv"
BEGIN, END = "<!-- day -->\n", "<!-- end of day -->"
SHORT = ("path.stepover_mm=18", "robot.controller.max_positions=2100")
SHORT_BREAKS, SHORT_DOOR = ((2, 10 * MINUTE), (3, 20 * MINUTE)), 1.2 * HOUR
DAYS = {"9 h": (NINE_HOURS, BREAKS, DOOR), "short": (SHORT, SHORT_BREAKS, SHORT_DOOR, 2.5 * POLL)}


def rows_of(name: str, day: Day, runs) -> list[str]:
    """Lines of the file of numbers: day, run, hours, pages, written, max, p99, rms [um], share within 5 um [%]."""
    hours, count = sum(day.times.duration) / HOUR, len(day.times.duration)
    lines = []
    for run, (error, length, _, written) in runs.items():
        size = size_of(error, length)
        sizes = ",".join(f"{getattr(size, key) / UM:.2f}" for key in ("max", "p99", "rms"))
        lines.append(f"{name},{run},{hours:.2f},{count},{written},{sizes},{100 * share_within(error, length):.1f}")
    return lines


def table(numbers: str) -> str:
    """The page's table from the file of numbers."""
    rows = [line.split(",") for line in numbers.splitlines()[1:]]
    text = "| day | pages | written anew | max, p99, rms [um] | path within 5 um |\n|---|---|---|---|---|\n"
    for day, run, hours, count, written, largest, p99, rms, share in rows:
        length = f" ({hours} h, {count} pages)" if run == "as written" else ""
        text += f"| {day}{length} | {run} | {written} | {largest}, {p99}, {rms} | {share} % |\n"
    return text


def section(numbers: str) -> str:
    """What the page says of the day."""
    late, first, second = (f"{t / MINUTE:.0f} min" for t in (LATE, BREAKS[0][1], BREAKS[1][1]))
    law, lag = ", ".join(f"{x:g}" for x in LAW_K), ", ".join(f"{100 * (x - 1):.0f}" for x in LAG)
    return f"""## A simulated day

`python docs/resume_day.py` drives the optic raster (2.25 mm between sweeps, 20 mm/s) on an arm that is not the one of
the robot file: after the reference duty its nodes are off by {law} K, its time constants by {lag} %,
its sensors by {OFFSET_K:g} K together and {NOISE_K:g} K of noise. It starts {late} late, stands {first} and {second} in
breaks, and after {DOOR / HOUR:g} h the air falls by 2 K in 10 min. Pages are no longer than their start window. On the
part, by the twin:

{table(numbers)}
`followed` is `cgen follow --within-um 5` with a look every {POLL / MINUTE:.0f} min. The tests simulate the short day
anew. What stays is the offset of the sensors, and what no sensor sees.

![Error on the part over the day](resume_day.svg)

"""


def picture(day: Day, runs) -> str:
    """Largest error on the part in each two minutes of the day, SVG."""
    width, height, left, right, top, base = 760, 330, 56, 740, 40, 280
    end = day.times.starts[-1].time + day.times.duration[-1]
    peak = max(float(error.max()) for error, *_ in runs.values()) / UM * 1.08
    x = lambda t: left + (right - left) * t / end  # noqa: E731
    y = lambda e: base - (base - top) * e / peak  # noqa: E731
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="system-ui,sans-serif">',
        '<rect width="100%" height="100%" fill="#fff"/>',
        f'<text x="{left}" y="22" font-size="14" fill="#1e293b">Largest error on the part [um] over the day [h]</text>',
    ]
    for begin, stop, page, _ in day.times.stretches(end):
        if not page:
            box = f'x="{x(begin):.1f}" y="{top}" width="{x(stop) - x(begin):.1f}" height="{base - top}"'
            parts.append(f'<rect {box} fill="#e2e8f0"/>')
    door = x(float(day.air.time[1]))
    parts.append(
        f'<line x1="{door:.1f}" y1="{top}" x2="{door:.1f}" y2="{base}" stroke="#64748b" stroke-dasharray="3 3"/>'
    )
    parts.append(f'<text x="{door + 4:.1f}" y="{top + 12}" font-size="11" fill="#64748b">door</text>')
    for value in range(0, int(peak) + 1, 5):
        parts.append(f'<line x1="{left}" y1="{y(value):.1f}" x2="{right}" y2="{y(value):.1f}" stroke="#e2e8f0"/>')
        parts.append(f'<text x="{left - 6}" y="{y(value) + 4:.1f}" font-size="11" text-anchor="end">{value}</text>')
    parts += [
        f'<text x="{x(hour * HOUR):.1f}" y="{base + 16}" font-size="11" text-anchor="middle">{hour}</text>'
        for hour in range(int(end / HOUR) + 1)
    ]
    for k, (run, (error, length, page, _)) in enumerate(runs.items()):
        points = []
        for start, span in zip(day.times.starts, day.times.duration, strict=False):
            rows = np.flatnonzero(page == start.page)
            if not len(rows):
                continue
            moments = start.time + span * (np.cumsum(length[rows]) - length[rows] / 2) / length[rows].sum()
            points += [
                f"{x(float(moments[part].mean())):.1f},{y(float(error[rows[part]].max()) / UM):.1f}"
                for part in np.array_split(np.arange(len(rows)), max(1, int(span / 120)))
            ]
        parts.append(f'<polyline points="{" ".join(points)}" fill="none" stroke="{TINTS[run]}" stroke-width="1.5"/>')
        at = left + 10 + 200 * k
        parts.append(f'<text x="{at}" y="{height - 12}" font-size="12" fill="{TINTS[run]}">{run}</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"


def page_with(text: str, numbers: str) -> str:
    """The page with the day in its place."""
    before, _, rest = text.partition(BEGIN)
    return before + BEGIN + section(numbers) + END + rest.partition(END)[2]


def main() -> None:
    """Simulate the days, and write numbers, picture and page."""
    use_machine()
    lines = ["day,run,hours,pages,written,max_um,p99_um,rms_um,share_percent"]
    for name, settings in DAYS.items():
        day, runs = simulate(*settings)
        lines += rows_of(name, day, runs)
        if name == "9 h":
            PICTURE.write_text(picture(day, runs), encoding="utf-8")
    NUMBERS.write_text("\n".join(lines) + "\n", encoding="utf-8")
    PAGE.write_text(page_with(PAGE.read_text(encoding="utf-8"), NUMBERS.read_text()), encoding="utf-8")


if __name__ == "__main__":
    main()
