"""What the help says beside the commands' own texts: their sections, and an example of each."""

from typing import Any, ClassVar

import typer.core

#: a command by its name, and how it is called
EXAMPLES = {
    "generate": "cgen generate paths/spiral_1300.toml -o out",
    "predict": "cgen predict paths/spiral_1300.toml --set process.feed_mm_s=40",
    "check": "cgen check paths/spiral_1300.toml --json --junit check.xml",
    "inspect": "cgen inspect JOB.LS --frames SYSFRAME.VA",
    "correct": "cgen correct JOB.LS --robot m710ic50 --before 'moving 200mm/s 5h' --max-um 20",
    "pages": "cgen pages JOB.LS -o out",
    "verify-backup": "cgen verify-backup out/SPIRAL_1300.LS backup/SPIRAL_1300.LS",
    "executed": "cgen executed out/SPIRAL_1300.LS --log run.csv --max-um 200",
    "resume": "cgen resume outputs/optic_spiral --from-page 2 --late 35min",
    "follow": "cgen follow outputs/optic_spiral --log temperatures.csv --within-um 5",
    "heat": "cgen heat paths/spiral_1300.toml",
    "whatif": "cgen whatif paths/spiral_1300.toml --vary process.feed_mm_s=20:200:7 -o out",
    "compare": "cgen compare out/before out/after --max-um 20",
    "identify": "cgen identify m710ic50 --poses poses.csv -o mine.toml",
    "validate": "cgen validate mine.toml --poses other_poses.csv",
    "identify-motion": "cgen identify-motion out/SPIRAL_1300.LS --log run.csv --robot mine.toml -o smooth.toml",
    "teach-frame": "cgen teach-frame mine.toml --touches touches.csv --artefact artefact.toml",
    "anchor": "cgen anchor paths/spiral_1300.toml --touches touches.csv --artefact artefact.toml -o state.toml",
    "plan-poses": "cgen plan-poses m710ic50 -n 60 -o poses",
    "plan-touches": "cgen plan-touches paths/spiral_1300.toml --artefact artefact.toml -n 8 -o touches",
    "offsets": "cgen offsets paths/spiral_1300.toml --state state.toml",
    "inspect-robot": "cgen inspect-robot m20ia -o sheet",
    "export-robot": "cgen export-robot m710ic50 --rise-K j2=11,j3=13 -o hot.urdf",
    "init": "cgen init my_cell",
    "schema": "cgen schema path -o path.schema.json",
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
    return f"\b\nExample:\n  {EXAMPLES[name]}"
