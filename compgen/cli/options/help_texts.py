"""What the help says beside the commands' own texts: their sections, and examples of each."""

from typing import Any, ClassVar

import typer.core

#: a command by its name, and how it is called, the usual way first
EXAMPLES = {
    "generate": (
        "cgen generate paths/spiral_1300.toml -o out",
        "cgen generate paths/optic_raster.toml --set path.stepover_mm=2 --set before.0.duration_h=3",
        "cgen generate paths/spiral_1300.toml --lift-all 50 -o dry",
    ),
    "predict": (
        "cgen predict paths/spiral_1300.toml --set process.feed_mm_s=40",
        "cgen predict paths/spiral_1300.toml --program --max-um 150",
    ),
    "check": (
        "cgen check paths/*.toml --junit results.xml",
        "cgen check paths/spiral_1300.toml --json --max-um 5",
    ),
    "inspect": (
        "cgen inspect JOB.LS --frames SYSFRAME.VA",
        "cgen inspect JOB.LS --robot m20ia --json",
    ),
    "correct": (
        "cgen correct JOB.LS --robot m710ic50 --before 'moving 200mm/s 5h' --max-um 20",
        "cgen correct out/JOB.LS --restore -o planned",
    ),
    "pages": ("cgen pages JOB.LS -o out",),
    "verify-backup": (
        "cgen verify-backup out/SPIRAL_1300.LS backup/SPIRAL_1300.LS",
        "cgen verify-backup outputs/optic_spiral backup --json",
    ),
    "executed": ("cgen executed out/SPIRAL_1300.LS --log run.csv --max-um 200",),
    "resume": (
        "cgen resume outputs/optic_spiral --from-page 2 --late 35min",
        "cgen resume outputs/optic_spiral --from-page 2 --log temperatures.csv --max-um 5",
    ),
    "follow": (
        "cgen follow outputs/optic_spiral --log temperatures.csv --within-um 5",
        "cgen follow outputs/optic_spiral --log temperatures.csv --started 0s --once --json",
    ),
    "heat": (
        "cgen heat paths/spiral_1300.toml",
        "cgen heat paths/spiral_1300.toml --json --max-um 20",
    ),
    "whatif": (
        "cgen whatif paths/spiral_1300.toml --vary process.feed_mm_s=20:200:7 -o out",
        "cgen whatif paths/spiral_1300.toml --vary before.0.duty=0.25,0.5,1 --correct --max-um 5",
        "cgen whatif paths/spiral_1300.toml --ask warmup --ask validity --within-um 5",
    ),
    "compare": ("cgen compare out/before out/after --max-um 20",),
    "identify": (
        "cgen identify m710ic50 --poses poses.csv -o mine.toml",
        "cgen identify m710ic50 --touches touches.csv --artefact artefact.toml -o mine.toml",
    ),
    "validate": (
        "cgen validate mine.toml --poses other_poses.csv",
        "cgen validate mine.toml --poses other_poses.csv --hot warm.csv --temperatures log.csv --max-um 150",
    ),
    "identify-motion": ("cgen identify-motion out/SPIRAL_1300.LS --log run.csv --robot mine.toml -o smooth.toml",),
    "teach-frame": ("cgen teach-frame mine.toml --touches touches.csv --artefact artefact.toml",),
    "anchor": (
        "cgen anchor paths/spiral_1300.toml --touches touches.csv --artefact artefact.toml -o state.toml",
        "cgen anchor paths/spiral_1300.toml --touches touches.csv --log temperatures.csv --json",
    ),
    "plan-poses": ("cgen plan-poses m710ic50 -n 60 -o poses",),
    "plan-touches": ("cgen plan-touches paths/spiral_1300.toml --artefact artefact.toml -n 8 -o touches",),
    "offsets": (
        "cgen offsets paths/spiral_1300.toml --state state.toml",
        "cgen offsets JOB.LS --robot m710ic50 --before 'moving 200mm/s 5h' --max-um 50",
    ),
    "inspect-robot": ("cgen inspect-robot m20ia -o sheet",),
    "export-robot": ("cgen export-robot m710ic50 --rise-K j2=11,j3=13 -o hot.urdf",),
    "init": (
        "cgen init my_cell",
        "cgen init --urdf arm.urdf",
    ),
    "schema": (
        "cgen schema path -o path.schema.json",
        "cgen schema robot",
    ),
}


class SectionedHelp(typer.core.TyperGroup):
    """An application whose help lists its commands in sections."""

    sections: ClassVar[dict[str, tuple[str, ...]]] = {}  # title to names, in the order of work

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands, a section after the other."""
        widest = max(map(len, self.commands))
        for title, names in self.sections.items():
            limit = formatter.width - 6 - widest
            rows = [(name.ljust(widest), self.commands[name].get_short_help_str(limit)) for name in names]
            with formatter.section(title):
                formatter.write_dl(rows)


def example_of(name: str) -> str:
    """The end of a command's help."""
    lines = EXAMPLES[name]
    return "\n".join([f"\b\nExample{'s' * (len(lines) > 1)}:", *(f"  {line}" for line in lines)])
