"""Every code that a finding may have: what it means, how much it may weigh, and what the user can do.

A code stands here and nowhere else as text; ``python docs/finding_tables.py`` makes docs/findings.md of it.
"""

from enum import StrEnum
from typing import Self


class Level(StrEnum):
    """How much a finding weighs."""

    OUTSIDE = "outside"  # a bound is broken: the job fails
    REFUSED = "refused"  # what was identified may not be used
    WARNING = "warning"
    NOTE = "note"


OUTSIDE, REFUSED, WARNING, NOTE = Level


class Code(StrEnum):
    """What a finding is about: its text as reports write it.

    Attributes:
        room: Of the package, the first that finds it.
        meaning: For the user, one sentence.
        remedy: What the user can do.
        levels: That a finding of this code may have.
    """

    room: str
    meaning: str
    remedy: str
    levels: tuple[Level, ...]

    def __new__(cls, text: str, room: str = "", meaning: str = "", remedy: str = "", *levels: Level) -> Self:
        """A code of the table below; called with its text alone, ``Code(text)`` finds it."""
        code = str.__new__(cls, text)
        code._value_ = text
        code.room, code.meaning, code.remedy, code.levels = room, meaning, remedy, levels
        return code

    # fmt: off
    UNITS_UNLIKELY = ("units.unlikely", "core", "A value looks as if it were in another unit.",
        "Compare it with the unit in its key's name; mend it or keep it.", WARNING)
    FILE_READ_AS = ("file.read_as", "core", "Says how a file of another writer's form was understood.",
        "Compare it with the file: delimiter, decimal sign, units, times, and what is left out.", NOTE)
    PATH_POINTS = ("path.points", "planning", "Says how far the curve leaves the lines between your points.",
        "Nothing; more points bring it nearer.", NOTE)
    PATH_LINES = ("path.lines", "planning", "Says how many lines and arcs your file has, and where the tool stops.",
        "Nothing; path.tolerance_um says how much corners are rounded.", NOTE)
    PATH_BULGE = ("path.bulge", "planning", "The curve leaves the line between two points by more than path.bulge_um.",
        "Give more points there, or path.through = 'lines'.", OUTSIDE)
    PATH_BELOW = ("path.below", "planning", "The curve goes below the lowest of your points.",
        "Give more points there, or path.through = 'lines'.", WARNING)
    PATH_END = ("path.end", "planning", "The file ends before its last line, or says something that is not used.",
        "Read the line that is named; mend the file where more was meant.", WARNING)
    PATH_STEPOVER = ("path.stepover", "planning", "The stepover is larger than the part.",
        "Make path.stepover_mm smaller, or compare it and the part's sizes with the drawing.", WARNING)
    PATH_HOLES = ("path.holes", "planning", "The tool runs on over holes of the part, at its height.",
        "Where it may not, give your own points with other heights there.", NOTE)
    SURFACE_MESH = ("surface.mesh", "planning", "Says how the path lies on the mesh or conic, and what has no contact.",
        "Look at the place on the page; move the path or take a mesh that reaches further.", WARNING, NOTE)
    SOURCES_MAP = ("sources.map", "error_model", "The program leaves the space in which the error map was measured.",
        "Measure lines that reach further, or move the path.", WARNING)
    SOURCES_BOX = ("sources.box", "error_model", "The joints leave the angles in which errors were identified.",
        "Measure poses there and identify again.", WARNING)
    SOURCES_START = ("sources.start", "error_model", "From which side the joints come at first is not known.",
        "Lead in with a longer move, always from the same side.", NOTE)
    BOUNDS_MAX_UM = ("bounds.max_um", "verification", "The largest error is above its bound.",
        "Lower the feed, mend what the report names as the cause, or raise bounds.max_um.", OUTSIDE)
    BOUNDS_P99_UM = ("bounds.p99_um", "verification", "The error that 99 % of the path keep is above its bound.",
        "As for bounds.max_um.", OUTSIDE)
    BOUNDS_RMS_UM = ("bounds.rms_um", "verification", "The root mean square of the error is above its bound.",
        "As for bounds.max_um.", OUTSIDE)
    BOUNDS_FEED_UM = ("bounds.feed_um", "verification", "The error along the feed is above its bound.",
        "As for bounds.max_um.", OUTSIDE)
    BOUNDS_CROSS_UM = ("bounds.cross_um", "verification", "The error across the path is above its bound.",
        "As for bounds.max_um.", OUTSIDE)
    BOUNDS_NORMAL_UM = ("bounds.normal_um", "verification", "The error along the tool is above its bound.",
        "As for bounds.max_um.", OUTSIDE)
    BOUNDS_AXIS_MDEG = ("bounds.axis_mdeg", "verification", "The tool's axis is tilted by more than its bound.",
        "As for bounds.max_um.", OUTSIDE)
    BOUNDS_OFF_PART = ("bounds.off_part", "verification",
        "An error is above a bound, but where the tool is off the part.", "Nothing; no bound is judged there.", NOTE)
    BOUNDS_NONE = ("bounds.none", "verification", "No bound is given: nothing says whether the result is good enough.",
        "Give bounds.max_um in the path file, or --max-um.", OUTSIDE)
    BOUNDS_GUARANTEED_MAX_UM = ("bounds.guaranteed.max_um", "verification", "Too few arms and days keep the maximum.",
        "Identify the robot better, or raise the bound to what the message says.", OUTSIDE)
    BOUNDS_GUARANTEED_P99_UM = ("bounds.guaranteed.p99_um", "verification",
        "Too few arms and days keep the 99 % bound.", "As for bounds.guaranteed.max_um.", OUTSIDE)
    BOUNDS_GUARANTEED_RMS_UM = ("bounds.guaranteed.rms_um", "verification", "Too few arms and days keep the rms bound.",
        "As for bounds.guaranteed.max_um.", OUTSIDE)
    BOUNDS_GUARANTEED_FEED_UM = ("bounds.guaranteed.feed_um", "verification",
        "Too few arms and days keep it along feed.", "As for bounds.guaranteed.max_um.", OUTSIDE)
    BOUNDS_GUARANTEED_CROSS_UM = ("bounds.guaranteed.cross_um", "verification", "Too few arms and days keep it across.",
        "As for bounds.guaranteed.max_um.", OUTSIDE)
    BOUNDS_GUARANTEED_NORMAL_UM = ("bounds.guaranteed.normal_um", "verification",
        "Too few arms and days keep it along the tool.", "As for bounds.guaranteed.max_um.", OUTSIDE)
    BOUNDS_GUARANTEED_AXIS_MDEG = ("bounds.guaranteed.axis_mdeg", "verification",
        "Too few arms and days keep the axis.", "As for bounds.guaranteed.max_um.", OUTSIDE)
    BOUNDS_GUARANTEED_TOGETHER = ("bounds.guaranteed.together", "verification",
        "Each guaranteed bound is kept alone, but not all at once.", "Raise one of them.", OUTSIDE)
    EXECUTED_THIS = ("executed.this", "verification", "The log is of this program, not of others.", "Nothing.", NOTE)
    EXECUTED_OTHER = ("executed.other", "verification", "The log is of another program than the one that is judged.",
        "Load the program that was meant.", OUTSIDE)
    EXECUTED_UNSURE = ("executed.unsure", "verification", "The log cannot tell this program from another one.",
        "Log a run of a stretch on which they differ.", WARNING)
    EXECUTED_ANOTHER = ("executed.another", "verification",
        "The log is off by more than corrections, or at one position.", "Give the program that ran.", OUTSIDE)
    EXECUTED_OFFSET = ("executed.offset", "verification", "Most of the deviation is one shift or one turn.",
        "Compare frame, tool and offsets on the pendant with those of the program.", OUTSIDE)
    EXECUTED_OLDER = ("executed.older", "verification", "The robot stood elsewhere: older correction, frame or tool.",
        "Load the new program and compare frame and tool; give an older correction with --also.", OUTSIDE)
    EXECUTED_PART = ("executed.part", "verification", "The log has a part of the path only; the rest is not judged.",
        "Log the whole run.", OUTSIDE)
    EXECUTED_NO_CLOCK = ("executed.no_clock", "verification",
        "The log has no steady motion that is long enough to find override and time.", "Log a longer run.", WARNING)
    EXECUTED_PERIODS = ("executed.periods", "verification", "Lines last whole periods, or not, unlike the file says.",
        "Set controller.rounds_up_to_period in the robot file as said.", WARNING)
    EXECUTED_OVERRIDE_CHANGED = ("executed.override_changed", "verification", "The override changed during the run.",
        "Run it at one override.", OUTSIDE)
    EXECUTED_OVERRIDE = ("executed.override", "verification", "It ran at another override than it is written for.",
        "Set the override to 100 %, or plan for the one that is used.", WARNING)
    EXECUTED_TIME = ("executed.time", "verification", "The run took another time than planned.",
        "Read the reason in the message; compare accelerations and the log's clock.", WARNING)
    EXECUTED_HELD = ("executed.held", "verification", "The robot was held where the program does not stop.",
        "Ask who or what held it; the heat is another one since.", WARNING, NOTE)
    EXECUTED_WAITED = ("executed.waited", "verification", "The robot stood at stops of the program.",
        "Nothing, where somebody meant it to.", NOTE)
    EXECUTED_NOTHING = ("executed.nothing", "verification", "No row is on a way that the program surely drives.",
        "Check that the log is of this program, and log a longer run.", OUTSIDE)
    EXECUTED_MAX = ("executed.max", "verification", "The run is further off its path than --max-um.",
        "Look at the place on the page; find what moved it.", OUTSIDE)
    EXECUTED_GAPS = ("executed.gaps", "verification", "The log has gaps; what happened in them is not seen.",
        "Log without gaps where it matters.", NOTE)
    EXECUTED_AWAY = ("executed.away", "verification", "Rows amid the log are far off the path and are not judged.",
        "Ask what the robot did there.", WARNING)
    EXECUTED_UNJUDGED = ("executed.unjudged", "verification",
        "Rows on joint motions, or on ways that are not sure, are not judged.", "Nothing.", NOTE)
    EXECUTED_NOT_THE_TOOL = ("executed.not_the_tool", "verification",
        "A log has what the controller knows, not the tool.", "Measure the part or the tool to know that.", NOTE)
    UNOBSERVABLE = ("unobservable", "identification", "No measured row sees some parameters: they stay near nominal.",
        "Measure what would see them, where they matter.", NOTE)
    SETUP = ("setup", "identification", "Two setups of an instrument agree and are taken as one.",
        "Nothing, if the instrument did not move.", NOTE)
    NOISES = ("noises", "identification", "Files differ in noise.", "Give sigma_um in all of them.", WARNING)
    FRAMES = ("frames", "identification", "The poses hardly turn the tool: its reflector's place stays unknown.",
        "Measure poses with other orientations, or a second reflector.", REFUSED, WARNING)
    SET_ASIDE = ("set_aside", "identification", "Too many rows do not fit the others.",
        "Find what moved during the measurement and measure again.", REFUSED)
    UNEXPLAINED = ("unexplained", "identification", "More is left than zeros, lengths and gears of this arm explain.",
        "Check the pendant table, the DH lengths and the order of the columns.", REFUSED)
    LEFT = ("left", "identification", "Unseen places are further off than instrument and repeatability explain.",
        "Give the arm's masses in [sources.loads], and measure repeatability: poses driven to three times.", WARNING)
    LENGTHS = ("lengths", "identification", "The fitted lengths are those of another arm.",
        "Give this arm's robot file, or mend its DH lengths.", REFUSED)
    NO_GAIN = ("no_gain", "identification", "No model predicts poses it has not seen better than the nominal arm.",
        "Measure more poses, as the message says.", REFUSED)
    STILL = ("still", "identification", "A joint never moves: its parameters stay at nominal.", "Move it.", WARNING)
    TURNED = ("turned", "identification", "Orientations turn unlike the arm.", "Check mastering, columns.", WARNING)
    NARROW = ("narrow", "identification", "A joint moves a little only: its gears are known there and nowhere else.",
        "Measure poses over its whole use.", WARNING)
    OUTLIER = ("outlier", "identification", "A row lies far from what the others say and is set aside.",
        "Look at the row; measure it again if it should count.", WARNING)
    OUTLIERS = ("outliers", "identification", "Too many rows lie far from the others to set them aside.",
        "Find what moved, and measure again.", WARNING)
    HELD = ("held", "identification", "A parameter is held near nominal by its prior.",
        "Measure what would tell it, where it matters.", WARNING, NOTE)
    FORECAST = ("forecast", "identification", "Later measurements lie further off than what was known before allows.",
        "Find out whether instrument, reflector or base moved; measure again.", REFUSED, WARNING)
    FORECAST_FEW = ("forecast.few", "identification", "Too few blocks could be foretold to judge the fit's own band.",
        "Measure as many poses as the message says.", NOTE)
    UNKNOWN_SIDES = ("unknown_sides", "identification", "Play explains rows of unknown sides.", "Leave no gaps.", NOTE)
    REVERSALS_WIDTH = ("reversals.width", "identification", "Says the lost motion of reversal runs.", "Nothing.", NOTE)
    REVERSALS_HELD = ("reversals.held", "identification", "No small reversal shows a joint's play until it is through.",
        "Run and measure reversals.csv of cgen plan-poses.", NOTE)
    WARM_UP = ("warm_up", "identification", "The warm-up was fitted without temperatures; nothing of it is written.",
        "Give a temperature log.", NOTE)
    LOG_WARM = ("log.warm", "identification", "The temperature log may not begin with a cold robot.",
        "Begin the log cold, or say with --reference what rises count from.", WARNING)
    LOG_CLOCK = ("log.clock", "identification", "The poses fit the temperature log far better with its clock moved.",
        "Mend the log's clock as the message says.", REFUSED)
    LOG_SWAPPED = ("log.swapped", "identification", "Two columns of the temperature log look swapped.",
        "Check which sensor is which, and mend the header.", WARNING)
    LOG_GAP = ("log.gap", "identification", "A sensor has no reading around measured poses; its rise is modelled.",
        "Nothing, where the model is good enough.", NOTE)
    LOG_LOOSE = ("log.loose", "identification", "Readings are far off, or jump.", "Check the contact.", NOTE, WARNING)
    LOG_MODELLED = ("log.modelled", "identification", "A part has no sensor: its rise is modelled from the others.",
        "Nothing; a sensor there would tell more.", NOTE)
    LOG_FITTED = ("log.fitted", "identification", "How parts of the arm warm was fitted to the log, or to the poses.",
        "Nothing; a sensor on each part would tell more.", NOTE)
    MOTION_SHORT = ("motion.short", "identification", "The log has too few steady stretches to hold some out.",
        "Log a longer run.", REFUSED)
    MOTION_HELD_OUT = ("motion.held_out", "identification", "The fit is no better than the plain program.",
        "Keep the robot file's [motion]; tell us of the controller.", REFUSED)
    MOTION_BLIND = ("motion.blind", "identification", "The path curves too little to show how the controller smooths.",
        "Log corners at CNT100, or curvature that changes, at full speed.", REFUSED)
    MOTION_NONE = ("motion.none", "identification", "The log shows the programmed path itself: no smoothing is seen.",
        "Log positions from behind the smoothing.", REFUSED)
    MOTION_PARTS = ("motion.parts", "identification", "Halves of a log, or its places and its times, disagree.",
        "Log one run of one program, at one override.", REFUSED)
    MOTION_MISFIT = ("motion.misfit", "identification", "The fit foretells; it leaves too much to command against.",
        "Nothing; what it leaves is in its band.", WARNING)
    MOTION_ALIKE = ("motion.alike", "identification", "The log cannot tell two kinds of smoothing apart.",
        "Log corners at CNT100, or curvature that changes, at full speed.", WARNING)
    MOTION_UNSURE = ("motion.unsure", "identification", "A log tells too little of the smoothing to command by.",
        "Log corners at CNT100, or curvature that changes, at full speed and 100 % override.", WARNING)
    MOTION_SLOWED = ("motion.slowed", "identification", "Rows of slowed-down motion are left out.", "Nothing.", NOTE)
    MOTION_LAG = ("motion.lag", "identification", "A log tells no common lag, which moves no path.", "Nothing.", NOTE)
    TIMING_LIMIT = ("timing.limit", "pipelines", "A joint passes a limit of speed, acceleration or jerk.",
        "Lower process.feed_mm_s.", OUTSIDE)
    TIMING_JOINT_USE = ("timing.joint_use", "pipelines",
        "A joint cannot keep the written speeds: the controller is slower.", "Lower process.feed_mm_s.", WARNING)
    TIMING_BELOW_FEED = ("timing.below_feed", "pipelines", "A part of the path is programmed below the feed.",
        "Lower the feed, or lengthen segments, as the message says.", NOTE)
    TIMING_FEED = ("timing.feed", "pipelines", "The feed is the next lower that a program can say.", "Nothing.", NOTE)
    TIMING_FEED_ERROR = ("timing.feed_error", "pipelines", "Speeds are rounded to what programs say.", "Nothing.", NOTE)
    TIMING_CLOCK = ("timing.clock", "pipelines", "The written text takes another time than was planned.",
        "Nothing; the report has the text's time.", NOTE)
    TIMING_RAMPS = ("timing.ramps", "pipelines", "Assumed accelerations move the tool while it changes speed.",
        "Give the accelerations of this robot (acceleration_deg_s2).", OUTSIDE, NOTE)
    TIMING_WHOLE_PERIODS = ("timing.whole_periods", "pipelines", "The time it takes with each line in whole periods.",
        "Set controller.rounds_up_to_period as your controller does it.", NOTE)
    TIMING_OVER_PERIODS = ("timing.over_periods", "pipelines", "Lines last longer than the periods laid out for them.",
        "Nothing, or lay the path out with other segments.", WARNING)
    TIMING_ASSUMED = ("timing.assumed", "pipelines", "A speed known at run time only is assumed; a wait takes no time.",
        "Write the speed into the program where its heat matters.", NOTE)
    TIMING_ORDER = ("timing.order", "pipelines", "Jumps, calls, loops: the heat is that of one pass as listed.",
        "Where a call or a loop lasts, make what follows a program of its own.", WARNING, NOTE)
    TIMING_SHORT = ("timing.short", "pipelines",
        "Segments are shorter than an interpolation period: the robot is slower there.", "Take fewer points.", NOTE)
    CONTROLLER_PERIODS = ("controller.periods", "pipelines", "The robot file leaves open whether lines are rounded up.",
        "Set controller.rounds_up_to_period: true, as FANUC's do, or false.", NOTE)
    THERMAL_NONE = ("thermal.none", "pipelines", "The robot file has no [thermal]: the arm is taken as cold.",
        "Identify how it warms.", WARNING, NOTE)
    THERMAL_COLD = ("thermal.cold", "pipelines", "Nothing is said of what was before: the cell starts cold.",
        "Give [[before]] or --before.", NOTE)
    THERMAL_BOX = ("thermal.box", "pipelines", "The heat model is asked beyond what it was fitted to.",
        "Measure there, or do not trust the warmth there.", WARNING)
    THERMAL_UNCERTAINTY = ("thermal.uncertainty", "pipelines", "The band assumes how well the heat is known.",
        "Give [thermal.uncertainty] in the robot file.", NOTE)
    THERMAL_MODEL_FORM = ("thermal.model_form", "pipelines", "Says how far two heat models of the robot differ here.",
        "Measure the warm arm, where the difference matters.", NOTE)
    SOURCES_SIGMA = ("sources.sigma", "pipelines", "Error sources have no sigma: they count as unmeasured.",
        "Identify the robot, or give sigma.", NOTE)
    SOURCES_LOADS = ("sources.loads", "pipelines", "Sag has assumed masses, or none; or an error has no effect.",
        "Give [sources.loads] as the arm was measured, and identify again.", WARNING, NOTE)
    SOURCES_ORDER = ("sources.order", "pipelines", "The side that joints come from is not sure at some lines.",
        "Nothing, or write the program in the order that it runs.", NOTE)
    POSTERIOR_MISSING = ("posterior.missing", "pipelines", "The robot file's correlations are missing: a wide band.",
        "Copy it along with the robot file, or identify again.", WARNING)
    POSTERIOR_OVERRIDDEN = ("posterior.overridden", "pipelines", "Overridden values have no correlations in the file.",
        "Leave the overrides out where the band matters.", WARNING)
    COMPENSATION_LIMITED = ("compensation.limited", "pipelines", "A limit binds: an error that is named stays there.",
        "Move the path, or raise the limit that the message names.", WARNING)
    COMPENSATION_MID_SPATIAL = ("compensation.mid_spatial", "pipelines",
        "The correction ripples the surface at 1 to 20 mm.", "Raise compensation.curvature_period_mm.", WARNING)
    COMPENSATION_SOLVER = ("compensation.solver", "pipelines", "Says which solver corrected.", "Nothing.", NOTE)
    BAND_LINEAR = ("band.linear", "pipelines", "The linear band differs from what flown draws say.",
        "Trust the guaranteed bounds, which are flown.", WARNING)
    BOUNDS_KNOWLEDGE = ("bounds.knowledge", "pipelines", "The bound is tighter than the robot file knows the arm.",
        "Identify the robot better, or raise the bound.", WARNING)
    BOUNDS_MAX = ("bounds.max", "pipelines", "The largest error of a corrected program is above --max-um.",
        "Read what the message says binds there, or raise --max-um.", OUTSIDE)
    AVERAGE_SPREAD = ("average.spread", "pipelines", "Says how far each start is from the one file.", "Nothing.", NOTE)
    AVERAGE_WIDE = ("average.wide", "pipelines", "A file for each start would be clearly better than one for all.",
        "Write a file for each start, or narrow the range of starts.", WARNING)
    AVERAGE_MODEL = ("average.model", "pipelines", "Over the starts the error model differs from the twin.",
        "Trust the starts that were flown, not what lies between.", WARNING)
    MOTION_KNOWN = ("motion.known", "pipelines", "Known smoothing by the controller leads the tool off its path.",
        "Lower the feed, or command against it as the message says.", WARNING, NOTE)
    MOTION_RUNS = ("motion.runs", "pipelines", "A program's runs begin as no logged one: nothing is commanded.",
        "Log the program of cgen plan-motion-log for cgen identify-motion.", WARNING, NOTE)
    MOTION_UNKNOWN = ("motion.unknown", "pipelines", "The controller's smoothing is not known, nor corrected for.",
        "Log a run for cgen identify-motion, or lower process.feed_mm_s.", WARNING, NOTE)
    MOTION_PREDISTORTED = ("motion.predistorted", "pipelines", "The program is commanded against smoothing at 100 %.",
        "Run it at 100 %.", WARNING, NOTE)
    MOTION_LEAD = ("motion.lead", "pipelines", "Smoothing moves the tool on the part: a bend is too near to its edge.",
        "Lengthen the lead, or stop at the bend.", WARNING, NOTE)
    PATH_FILE = ("path.file", "pipelines", "The tool's distance from your own file, read a second time.",
        "If outside, the path is not this file's: do not load it, and report it.", OUTSIDE, NOTE)
    PATH_LEAD_IN = ("path.lead_in", "pipelines", "Leads are longer than you asked, so that play is taken up.",
        "Nothing; process.lead_in = false keeps them short.", NOTE)
    PATH_THINNED = ("path.thinned", "pipelines", "Waypoints that lines do not need were left out.", "Nothing.", NOTE)
    PATH_ARCS = ("path.arcs", "pipelines", "Says how many arcs and lines stand for the waypoints.", "Nothing.", NOTE)
    PATH_ARCS_ORIENTATION = ("path.arcs_orientation", "pipelines", "The tool may tilt at an arc's via.",
        "Try one arc on the robot, or write lines.", WARNING, NOTE)
    FRAME_TAUGHT = ("frame.taught", "job", "How the part's frame was taught does not count, or nobody says it.",
        "Teach it with cgen teach-frame, or say frame.taught.", NOTE)
    FRAME_PENDANT = ("frame.pendant", "job", "The frame was taught on the pendant: the arm's errors are in it.",
        "Teach it with cgen teach-frame.", NOTE)
    FRAME_HOT = ("frame.hot", "job", "The frame was taught by a warm arm: its heat would be corrected twice.",
        "Teach it with cgen teach-frame, without --nominal.", WARNING)
    FRAME_MODEL = ("frame.model", "job", "The frame was taught through another or a nominal robot file.",
        "Identify the robot and teach the frame anew.", WARNING)
    FRAME_UNCERTAINTY = ("frame.uncertainty", "job",
        "Says how well the part's place is known; it is in the band and in no bound.", "Nothing.", NOTE)
    FRAME_COLD = ("frame.cold", "pipelines", "The frame counts as taught by a cold arm.",
        "If the arm was warm, give its log with --temperatures.", NOTE)
    FRAME_LENGTH = ("frame.length", "pipelines", "The arm measures a certified length wrongly.",
        "Check the artefact's temperature, or identify the arm with --touches.", WARNING)
    FRAME_LEFT = ("frame.left", "pipelines", "The touches fit each other, or [probe], less than the arm explains.",
        "Mend [probe], the spheres' places or the joints; leave out spheres that have moved.", WARNING)
    STATE = ("state", "job", "The robot begins as a state from cgen anchor has it.",
        "If something moved, find what before it runs.", WARNING, NOTE)
    ANCHOR_VERDICT = ("anchor.verdict", "pipelines", "What the touches say of the robot now.",
        "Do what the message names as the next step.", OUTSIDE, NOTE)
    ANCHOR_MOVED = ("anchor.moved", "pipelines", "Something moved since the robot was identified.",
        "Find what moved; teach the frame or identify again.", WARNING)
    ANCHOR_PHYSICS = ("anchor.physics", "pipelines", "The forecast does not explain the touches: physics is missing.",
        "Check the artefact's temperature_degC, and the day; then identify the robot again.", WARNING)
    ANCHOR_TOUCH = ("anchor.touch", "pipelines", "A touch went wrong and is left out.", "Touch it again.", WARNING)
    ANCHOR_NOISE = ("anchor.noise", "pipelines", "Touches scatter more than their sigma says.",
        "Clean probe and spheres, and touch again, or give the true sigma_um.", WARNING)
    ANCHOR_LEFT_OUT = ("anchor.left_out", "pipelines", "The others foretell a touch badly.", "Touch it again.", WARNING)
    ANCHOR_SIGMA = ("anchor.sigma", "pipelines", "No sigma_um of touches: the usual is taken.", "Give sigma_um.", NOTE)
    ANCHOR_PLAY = ("anchor.play", "pipelines", "A joint stood: its play may be another.", "Turn it first.", WARNING)
    ANCHOR_COLD = ("anchor.cold", "pipelines", "Nothing says that it was warm.", "Give [[before]] or a log.", NOTE)
    TOUCHES_CERTIFIED = ("touches.certified", "pipelines", "The artefact does not say whether it is certified.",
        "Say artefact.certified.", NOTE)
    TOUCHES_UNKNOWN_PLACE = ("touches.unknown_place", "pipelines",
        "A sphere has no place: a touch of it anchors nothing.", "Give its place where it should count.", NOTE)
    TOUCHES_REACH = ("touches.reach", "pipelines", "A target cannot be touched in the program's posture.",
        "Set the artefact up elsewhere.", WARNING)
    TOUCHES_TOO_FEW = ("touches.too_few", "pipelines", "Fewer touches are planned than cgen anchor asks for.",
        "Plan more touches.", WARNING)
    TOUCHES_MORE_THAN_USEFUL = ("touches.more_than_useful", "pipelines", "Later touches tell hardly more.",
        "Plan fewer, as the message says.", NOTE)
    TOUCHES_WAY = ("touches.way", "pipelines", "The way between two touches comes too near to something.",
        "Teach a position between them.", WARNING)
    RESUME_JOIN = ("resume.join", "pipelines", "There is a step where new pages join the old ones.",
        "Begin at an earlier page, or accept the step where it is drift.", OUTSIDE, WARNING)
    WRITTEN_ROBOT_FILE = ("written.robot_file", "pipelines", "The program was made with another robot file than this.",
        "Name that file with --robot, or generate the program anew.", WARNING)
    CONTROLLER_SIGNATURE = ("controller.signature", "pipelines", "The controller corrects its own geometry.",
        "Have only those error sources active that it does not know.", NOTE)
    CONTROLLER_SIZE = ("controller.size", "pipelines", "The program's size against what the controller holds.",
        "If it cannot be loaded, part it with cgen pages or take fewer points.", OUTSIDE, WARNING, NOTE)
    PROGRAM_DRY_RUN = ("program.dry_run", "pipelines", "The program runs above its place, clear of the part.",
        "Use it for the dry run only.", WARNING)
    PROGRAM_CALLED = ("program.called", "pipelines", "A called program is not beside it.", "Put it there.", WARNING)
    PROGRAM_CONTRADICTION = ("program.contradiction", "pipelines", "The program contradicts itself.",
        "Mend the lines that are named; what depends on them is not corrected.", WARNING)
    ROBOT_UNATTAINABLE = ("robot.unattainable", "pipelines", "The robot cannot take positions of the program.",
        "Say the right robot with --robot, or other frames with --frames.", OUTSIDE, WARNING)
    ROBOT_NAMED = ("robot.named", "pipelines", "The program's remarks name another robot.",
        "Check that this is the robot that runs it.", WARNING)
    ROBOT_GROUPS = ("robot.groups", "pipelines", "Positions hold another motion group as well; group 1 is taken.",
        "Nothing, if group 1 is this robot.", NOTE)
    ROBOT_CARRIED = ("robot.carried", "pipelines", "An extended axis carries the arm.",
        "Check the places of its base in the frames table.", NOTE)
    REGISTERS_FORM = ("registers.form", "pipelines", "A register is taken for Cartesian, which nothing says.",
        "Give its form in the table of registers.", NOTE)
    TEXT_DECIMALS = ("text.decimals", "pipelines", "The file's digits say places more coarsely than the correction.",
        "Write the program with three decimals.", NOTE)
    TEXT_JOINT_FORM = ("text.joint_form", "pipelines", "Corrected positions are in joint form, which is less exact.",
        "Teach them in Cartesian form, or give their tool with --frames.", WARNING, NOTE)
    CORRECTION_NONE = ("correction.none", "pipelines", "Nothing was corrected.",
        "Do what the message says: cgen inspect, cgen identify, or [thermal].", OUTSIDE)
    CORRECTION_WORSE = ("correction.worse", "pipelines", "A line would become worse.",
        "Do not load it; find what is special at this line.", OUTSIDE, WARNING)
    CORRECTION_TURN = ("correction.turn", "pipelines", "A joint turns further than corrected: a singularity is near.",
        "Teach the position elsewhere.", OUTSIDE)
    CORRECTION_REACH = ("correction.reach", "pipelines", "The way between two positions leaves the reach or a limit.",
        "Teach a position between, or move the part.", OUTSIDE, WARNING)
    CORRECTION_ORDER = ("correction.order", "pipelines",
        "The robot may come from elsewhere: only the line's end is judged.", "Nothing.", NOTE)
    PROJECT_FILE = ("project.file", "pipelines", "Says what the project's cgen.toml gives, and what in it is looser.",
        "Compare it with what the path file shall have; say it there.", WARNING, NOTE)
    CORRECTION_UNSAFE = ("correction.unsafe", "pipelines", "Some lines go where run time decides: they stay.",
        "Read the reason; cgen inspect lists them all.", WARNING)
    CORRECTION_HELD = ("correction.held", "pipelines", "Positions are left as they are.",
        "Read the reason at the lines that are named.", WARNING)
    CORRECTION_LIMITED = ("correction.limited", "pipelines", "A limit of the correction binds: an error stays there.",
        "Raise the limit, or teach the position elsewhere.", WARNING)
    CORRECTION_SHARED = ("correction.shared", "pipelines",
        "A position wants several corrections: their mean is written.", "Part them with --split.", WARNING)
    CORRECTION_MIXED = ("correction.mixed", "pipelines",
        "A position is also used where nothing may change: it stays as it is.", "Part them with --split.", WARNING)
    CORRECTION_STRAIGHT = ("correction.straight", "pipelines",
        "Between far positions an error stays in the middle of a line.", "Put points into them with --insert.", NOTE)
    CORRECTION_ARC = ("correction.arc", "pipelines",
        "An arc sweeps more than 180 deg once corrected; a controller may refuse it.", "Part it in two.", WARNING)
    CORRECTION_FLAT_ARC = ("correction.flat_arc", "pipelines",
        "An arc is one straight line; a controller may refuse it.", "Teach its via elsewhere, or a line.", WARNING)
    CORRECTION_MARK = ("correction.mark", "pipelines", "The program cannot carry compgen's mark.",
        "Keep the provenance file beside it.", NOTE)
    OFFSETS_JOINT_FORM = ("offsets.joint_form", "pipelines", "No offset moves positions in joint form.",
        "Teach them in Cartesian form.", WARNING)
    OFFSETS_DOUBLED = ("offsets.doubled", "pipelines", "Some motions have an Offset or a frame of their own already.",
        "Add the register's numbers to theirs.", WARNING)
    OFFSETS_WORLD = ("offsets.world", "pipelines", "Positions in World take no user frame.",
        "Teach them in a frame, or use the position register.", NOTE)
    OFFSETS_USELESS = ("offsets.useless", "pipelines", "This offset leaves no less than none does.",
        "Use the corrected program.", WARNING)
    EXECUTED_RECORD = ("executed.record", "pipelines", "The record is of another program.", "Give its own.", WARNING)
    EXECUTED_UNLIKE = ("executed.unlike", "pipelines", "A program given with --also is another path.", "Nothing.", NOTE)
    # fmt: on
