"""compgen: predict where a warming robot's tool will be, and write the program that cancels the error.

In a notebook:

    import compgen

    job = compgen.load_job("paths/spiral_1300.toml", overrides={"process.feed_mm_s": 100})
    prediction = compgen.predict(job)  # the error without correction: arrays, to_dataframe(), plot()
    result = compgen.generate(job)  # the corrected program, proven: text, report, findings, verdict
    result.files()  # what ``cgen generate`` would write, by name; nothing is written

    program = compgen.read_program("PART.LS")
    compgen.correct("PART.LS", robot="m710ic50", before="moving 200mm/s 5h", max_um=50)
    compgen.study("paths/spiral_1300.toml", vary={"duty": [0.2, 0.5]}).to_dataframe()
    compgen.identify("m710ic50", poses="poses.csv")

Every function gives what the command of ``cgen`` gives, number for number and byte for byte. Arrays are in SI: m, rad,
s and K. Bad input raises an InputError, a job that the robot cannot do an ImpossibleError; both are CompgenErrors, and
say what the command line says. What is logged goes to the logger ``compgen``. docs/python.md has the whole page.
"""

from importlib import import_module

from compgen.core.version import __version__ as __version__

TYPE_CHECKING = False  # as type checkers know it; the import of typing would be most of this package's

if TYPE_CHECKING:
    from compgen.cli.commands.write_program import write_program as write_program
    from compgen.cli.this_machine import find_machine as find_machine
    from compgen.core.exceptions import CompgenError as CompgenError
    from compgen.core.exceptions import FrozenError as FrozenError
    from compgen.core.exceptions import ImpossibleError as ImpossibleError
    from compgen.core.exceptions import InputError as InputError
    from compgen.core.exceptions import ShapeError as ShapeError
    from compgen.core.findings import Finding as Finding
    from compgen.fanuc.listing.listing import LsProgram as LsProgram
    from compgen.job.job import Job as Job
    from compgen.report.notebook.comparisons import ComparedOutputs as ComparedOutputs
    from compgen.report.notebook.comparisons import compare as compare
    from compgen.report.notebook.jobs import GeneratedProgram as GeneratedProgram
    from compgen.report.notebook.jobs import Prediction as Prediction
    from compgen.report.notebook.jobs import generate as generate
    from compgen.report.notebook.jobs import load_job as load_job
    from compgen.report.notebook.jobs import load_robot as load_robot
    from compgen.report.notebook.jobs import predict as predict
    from compgen.report.notebook.programs import CorrectedProgram as CorrectedProgram
    from compgen.report.notebook.programs import correct as correct
    from compgen.report.notebook.programs import read_program as read_program
    from compgen.report.notebook.robots import IdentifiedRobot as IdentifiedRobot
    from compgen.report.notebook.robots import identify as identify
    from compgen.report.notebook.studies import StudyResult as StudyResult
    from compgen.report.notebook.studies import study as study
    from compgen.robot.robot import Robot as Robot
    from compgen.verification.verdict import Verdict as Verdict

#: what ``help(compgen)`` shows, by its module, loaded when it is first used: the command line starts at once
_SHOWN = {
    "load_job": "compgen.report.notebook.jobs",
    "load_robot": "compgen.report.notebook.jobs",
    "predict": "compgen.report.notebook.jobs",
    "generate": "compgen.report.notebook.jobs",
    "correct": "compgen.report.notebook.programs",
    "identify": "compgen.report.notebook.robots",
    "study": "compgen.report.notebook.studies",
    "compare": "compgen.report.notebook.comparisons",
    "read_program": "compgen.report.notebook.programs",
    "write_program": "compgen.cli.commands.write_program",
    "Prediction": "compgen.report.notebook.jobs",
    "GeneratedProgram": "compgen.report.notebook.jobs",
    "CorrectedProgram": "compgen.report.notebook.programs",
    "IdentifiedRobot": "compgen.report.notebook.robots",
    "StudyResult": "compgen.report.notebook.studies",
    "ComparedOutputs": "compgen.report.notebook.comparisons",
}
#: what else is public: types of arguments and results, exceptions, and where a run's compiler and cores come from
_MODULES = _SHOWN | {
    "Job": "compgen.job.job",
    "Robot": "compgen.robot.robot",
    "LsProgram": "compgen.fanuc.listing.listing",
    "Finding": "compgen.core.findings",
    "Verdict": "compgen.verification.verdict",
    "CompgenError": "compgen.core.exceptions",
    "InputError": "compgen.core.exceptions",
    "ShapeError": "compgen.core.exceptions",
    "FrozenError": "compgen.core.exceptions",
    "ImpossibleError": "compgen.core.exceptions",
    "find_machine": "compgen.cli.this_machine",
}
__all__ = list(_SHOWN)


if not TYPE_CHECKING:  # whose checkers would take any name for a public one

    def __getattr__(name):
        """A public name, loaded now."""
        if name not in _MODULES:
            raise AttributeError(f"module 'compgen' has no attribute {name!r}")
        value = globals()[name] = getattr(import_module(_MODULES[name]), name)
        return value


def __dir__() -> list[str]:
    """The public names."""
    return sorted([*_MODULES, "__all__", "__doc__", "__version__"])
