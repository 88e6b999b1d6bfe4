"""What the program writes as ``result.json``, as dataclasses.

Generated from the program's own types: ``ASID_WRITE=1 cargo test --test python_types`` in the repository.
A number that was not finite is NaN; a field that may be missing is ``None`` then.
"""

# Lines are as long as the sentences of the program's own documentation.
# ruff: noqa: E501

from __future__ import annotations

import dataclasses
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from asid.records import Record, Result

#: Numbers, in as many dimensions as the field has.
Array = NDArray[np.float64]

Edge = Literal["low", "high"]

Joint = Literal["rigid", "revolute", "prismatic"]

Measure = Literal["metric", "success_rate"]

VerdictKind = Literal["none", "effects", "unknown"]


@dataclasses.dataclass(frozen=True, eq=False)
class Articulation(Record):
    """How two parts are joined."""

    axis: Array | None
    """Unit vector along the axis in the fixed part's frame; `None` for a rigid joint."""
    axis_std: float | None
    """Standard deviation of the axis, rad."""
    joint: Joint
    """The most probable kind."""
    origin: Array | None
    """Point of the axis nearest to the moving part, in the fixed part's frame, m; `None` but for a revolute joint."""
    origin_std: float | None
    """Standard deviation of the origin across the axis, m."""
    probability: Array
    """Probability of each kind: rigid, revolute, prismatic."""
    residual: float
    """Root mean square of the whitened residual."""
    travel: float
    """How far the joint moved: largest less smallest angle (rad) or shift (m)."""


@dataclasses.dataclass(frozen=True, eq=False)
class Cost(Record):
    """Cost."""

    env_steps: int
    physics_steps: int
    wall_s: float


@dataclasses.dataclass(frozen=True, eq=False)
class Direction(Record):
    """A combination of unknowns that the data do not see."""

    weights: list[tuple[str, float]]
    """Name of each unknown that takes part, and its share in prior deviations; the squares of all shares sum to 1."""


@dataclasses.dataclass(frozen=True, eq=False)
class Downstream(Record):
    """Downstream."""

    metric: str
    success: bool
    value: float


@dataclasses.dataclass(frozen=True, eq=False)
class Exploration(Record):
    """What the exploration tells about the unknowns."""

    a_optimality: float
    contact_fraction: float
    expected_std: Array
    log_det: float
    objective: str
    trace: float


@dataclasses.dataclass(frozen=True, eq=False)
class Perturbation(Record):
    """What is off in a perturbed world."""

    contact_damping: float
    """Factor of the contacts' damping ratio."""
    contact_time: float
    """Factor of the contacts' time constant."""
    mass: dict[str, float]
    """Factor of the mass of each body that lies free, with all that hangs on it."""
    servo_lag: float
    """Time constant of the servos' lag, s."""
    steps: int
    """Physics steps in one of the simulator's."""
    tracker: TrackerPerturbation
    """The tracker."""
    left_out: list[str] = dataclasses.field(default_factory=list)
    """Parts that the engine or the scene cannot have, and why."""


@dataclasses.dataclass(frozen=True, eq=False)
class TrackerPerturbation(Record):
    """What is off in a tracker."""

    dropout: float
    """Share of readings that are lost."""
    every: int
    """Frames from one reading to the next."""
    latency: float
    """Age of a reading, s."""
    offset: dict[str, Array]
    """Constant error of each signal: numbers and vectors in their unit, a rotation vector (rad) for an orientation."""


@dataclasses.dataclass(frozen=True, eq=False)
class Unknown(Record):
    """An unknown: truth where it is known, estimate and interval."""

    estimate: float
    interval95: Array
    name: str
    std: float | None
    """Null where the data do not see it: their deviation is infinite, which JSON cannot say."""
    unit: str
    at_edge: Edge | None = None
    """End of the prior's range that the posterior piles up at."""
    searched: Array | None = None
    """What was searched in the end, where the search went on past that end."""
    truth: float | None = None
    unidentified: bool = False
    """The data do not see it: what is said of it is the prior."""


@dataclasses.dataclass(frozen=True, eq=False)
class Versions(Record):
    """What made a result."""

    asid: str
    engine: str
    git: str


@dataclasses.dataclass(frozen=True, eq=False)
class World(Record):
    """What a result says of its real world."""

    backend: str
    world: str
    perturbation: Perturbation | None = None


@dataclasses.dataclass(frozen=True, eq=False)
class Run(Result):
    """`result.json` of `run`."""

    backend: str
    cost: Cost
    downstream: Downstream
    exploration: Exploration
    explorer: str
    identifier: str
    parameters: list[Unknown]
    real: World
    schema: int
    seed: int
    solver: str
    task: str
    versions: Versions
    articulation: Articulation | None = None
    misfit: float | None = None
    """Root mean square of the residuals at the best fit, in standard deviations of noise and of the simulator's roughness together; missing where the identifier fits nothing to the readings."""
    residual: float | None = None
    """Root mean square of the residuals at the best fit, in standard deviations of the noise."""
    unseen: list[Direction] = dataclasses.field(default_factory=list)


@dataclasses.dataclass(frozen=True, eq=False)
class ExploredTask(Result):
    """`result.json` of `explore`."""

    backend: str
    cost: Cost
    exploration: Exploration
    explorer: str
    schema: int
    seed: int
    start: dict[str, float]
    task: str
    versions: Versions


@dataclasses.dataclass(frozen=True, eq=False)
class MotionUnknown(Record):
    """What is known of an unknown, in its unit."""

    motion: float
    name: str
    prior: float
    """Standard deviations: of the prior, by the logs so far, by this motion, by both."""
    reference: float
    """What shares are taken of: the value, or half the width of the range where it is zero."""
    repeats: int | None
    """Plays of the motion until it is known to the precision asked for, with the logs; null where no number of them suffices."""
    unit: str
    value: float
    """The value about which the motion was designed."""
    both: float | None = None
    by_slopes: float | None = None
    """What slopes alone would promise of this motion, where contact limits what it tells."""
    logs: float | None = None


@dataclasses.dataclass(frozen=True, eq=False)
class Motion(Result):
    """`result.json`."""

    backend: str
    broken: str | None
    """What is broken where nothing could be kept; null where all limits hold."""
    cost: Cost
    engine: str
    explorer: str
    machine: str
    next_limit: str | None
    """The limit that a motion larger by a quarter would break."""
    noise: dict[str, float]
    notes: list[str]
    nuisance: list[str]
    objective: str
    period: float
    precision: float
    """Precision, relative to the value, that the repeats are counted for."""
    scale: float
    """Factor by which the motion was made smaller to keep all limits."""
    schema: int
    seconds: float
    seed: int
    unknowns: list[MotionUnknown]
    unseen: list[Direction] = dataclasses.field(default_factory=list)
    """Combinations that neither logs nor motion see."""


@dataclasses.dataclass(frozen=True, eq=False)
class Identification(Result):
    """`result.json` of `identify`."""

    backend: str
    cost: Cost
    identifier: str
    logs: list[str]
    parameters: list[Unknown]
    residual: float
    """Root mean square of the residuals at the best fit, in standard deviations of the noise."""
    schema: int
    seed: int
    starts: list[dict[str, float]]
    """Start pose of each episode at the best fit."""
    task: str
    versions: Versions
    articulation: Articulation | None = None
    misfit: float | None = None
    """Root mean square of the residuals at the best fit, in standard deviations of noise and of the simulator's roughness together; missing where the identifier fits nothing to the readings."""
    unseen: list[Direction] = dataclasses.field(default_factory=list)
    """Combinations of unknowns that the logs do not see."""


@dataclasses.dataclass(frozen=True, eq=False)
class FitGap(Record):
    """Gaps in units of the noise."""

    identified: float
    """With the parameters fitted, on logs held out."""
    identified_fitted: float
    nominal: float
    """With the model as given, on logs held out."""
    nominal_fitted: float
    """The same on the logs that were fitted."""


@dataclasses.dataclass(frozen=True, eq=False)
class StudyIdentification(Result):
    """`result.json`."""

    backend: str
    cost: Cost
    gap: FitGap
    held_out: list[str]
    identifier: str
    logs: list[str]
    misfit: float
    """Root mean square of the residuals at the best fit, in standard deviations of noise and of the simulator's roughness together."""
    parameters: list[Unknown]
    residual: float
    """Root mean square of the residuals at the best fit, in standard deviations of the noise."""
    schema: int
    seed: int
    study: str
    versions: Versions
    left_out: list[str] = dataclasses.field(default_factory=list)
    """What was left out of the logs, and how their stamps were read where that is in doubt."""
    unseen: list[Direction] = dataclasses.field(default_factory=list)
    """Combinations of unknowns that the logs do not see."""


@dataclasses.dataclass(frozen=True, eq=False)
class Calibration(Record):
    """What the diagnosis says of logs that were simulated in place of the real ones."""

    p_no_gap: float | None
    """Probability of as large a gap where the model lacks nothing; `None` where that was not simulated."""
    probability: float | None
    """Probability that the real logs' answer is right, by Bayes' rule over these runs; `None` where none gave it."""
    rows: list[CalibrationRow]
    """By what the simulated machine lacked."""
    runs: int
    """Simulated sets of logs that were diagnosed."""


@dataclasses.dataclass(frozen=True, eq=False)
class CalibrationRow(Record):
    """Diagnoses of machines that lack the same."""

    effects: list[str]
    """What they lack, as fitted to the real logs; empty for nothing."""
    none: int
    """Runs that said that nothing is missing, where that is wrong."""
    other: int
    """Runs that named other effects."""
    probability: float
    """Mean probability that they stated."""
    right: int
    """Runs that said just this."""
    runs: int
    """Runs."""
    unknown: int
    """Runs that named no effect."""


@dataclasses.dataclass(frozen=True, eq=False)
class Check(Record):
    """A check before the diagnosis."""

    check: str
    """Name."""
    detail: str
    """What was seen, and what to do."""
    ok: bool
    """Whether it passed."""


@dataclasses.dataclass(frozen=True, eq=False)
class DetectionLimit(Record):
    """The smallest size of an effect that these logs could have shown."""

    effect: str
    """Effect at its site."""
    parameter: str
    """Its parameter."""
    value: float
    """Value from which on it is seen; NaN where no value within its range is."""
    recognised: float | None = None
    """At twice that value: the share of such logs by which it is ranked first; `None` where it is not known."""
    taken_for: str | None = None
    """The effect that most of the others rank first; `None` where there is none."""
    unit: str | None = None
    """Unit of the parameter; may be empty."""


@dataclasses.dataclass(frozen=True, eq=False)
class Effect(Record):
    """An effect with its marginal probability."""

    at_bound: bool
    """Whether a fitted value is at the end of its range: the best one may lie beyond."""
    effect: str
    """Name."""
    gap_closed: float | None
    """Share of the excess squared gap that it closes alone."""
    intervals95: dict[str, Array]
    """95 % intervals of those that were fitted."""
    parameters: dict[str, float]
    """Fitted values."""
    probability: float
    """Sum of the probabilities of the hypotheses that it is in."""
    site: str
    """Site; empty for an effect of the whole scene."""
    units: dict[str, str]
    """Units of the values at this site."""


@dataclasses.dataclass(frozen=True, eq=False)
class Gap(Record):
    """Gaps on the logs held out, root mean square in units of the noise."""

    closed: float | None
    """Share of the excess squared gap that they close, negative where they widen it; null where there is none."""
    closed_interval95: Array | None
    """95 % interval of it, by a bootstrap over episodes; null where fewer than three are held out."""
    identified: float
    """After fitting the study's own parameters."""
    noise_floor: float
    """1 by definition."""
    nominal: float
    """The model as given."""
    refined: float
    """With the verdict's effects."""
    shares: Shares | None
    """By what it goes with; `None` where there is none."""
    signals: list[SignalGap]
    """By sensor."""
    p_value: float | None = None
    """Probability that a machine that lacks nothing shows as much evidence for its best candidate; `None` where that is not known."""


@dataclasses.dataclass(frozen=True, eq=False)
class Group(Record):
    """One law at several sites."""

    effect: str
    """Effect."""
    sites: list[str]
    """Its sites."""


@dataclasses.dataclass(frozen=True, eq=False)
class Hypothesis(Record):
    """A set of effects, or `none` or `unknown`, with its probability."""

    effects: list[str]
    """Effects at their sites."""
    probability: float
    """Probability."""


@dataclasses.dataclass(frozen=True, eq=False)
class Isolability(Record):
    """How well the logs tell effects apart: principal angles between what they add to the model along the logs, what the study's parameters can do projected out."""

    angles: Array
    """Smallest angle between each two, rad: 0 where they act alike, pi / 2 where they have nothing in common."""
    effects: list[str]
    """Effects at their sites, the most evident first."""


@dataclasses.dataclass(frozen=True, eq=False)
class MissingForce(Record):
    """The generalized force that the model lacks at a degree of freedom: its deviation over the training logs."""

    correlation_time: float
    """Time over which it stays much the same, s."""
    dof: str
    """Joint; with the axis (`.x`, `.rx`, …) where it has several."""
    identified: float
    """After fitting the study's parameters."""
    refined: float
    """With the verdict's effects."""
    unit: str
    """`N` or `N m`."""


@dataclasses.dataclass(frozen=True, eq=False)
class NextExperiment(Record):
    """The experiment that would tell rivals apart."""

    how: str
    """How."""
    separates: list[str]
    """What it would tell apart."""
    file: str | None = None
    """File of its commands, beside the result; empty where there are none to play."""


@dataclasses.dataclass(frozen=True, eq=False)
class NotTried(Record):
    """A stage that a time limit or an interruption cut short."""

    effects: list[str]
    """For which sets of effects, `a@x + b@y`; empty where it concerns none."""
    stage: str
    """What was left out."""


@dataclasses.dataclass(frozen=True, eq=False)
class Place(Record):
    """A share of the excess squared residual."""

    condition: str | None
    """A readable condition under which it arises, where one is found."""
    regime: str
    """Regime of motion."""
    share: float
    """Share of the excess."""
    signal: str
    """Entry of a sensor."""


@dataclasses.dataclass(frozen=True, eq=False)
class RankedSet(Record):
    """A set of effects with the evidence for it over the model without effects, natural logarithms."""

    effects: list[str]
    """Effects at their sites."""
    fitted: float | None
    """With the set in the model, values and noise fitted."""
    screened: float | None
    """In the first screening: to first order, at fixed noise."""


@dataclasses.dataclass(frozen=True, eq=False)
class RealWorldTrials(Record):
    """A task in the real world with one simulator after the other."""

    condition: str
    """Its condition; may be empty."""
    effects: list[str]
    """Effects that the real world has and the simulator lacks."""
    experiments: str
    """Episodes that were played to tell explanations apart, in words; may be empty."""
    metric: str
    """Name of its metric."""
    rule: str
    """The rule of success, in words."""
    task: str
    """The task."""
    trials: list[TaskTrial]
    """One a world and simulator, in the order shown."""
    truth: list[tuple[str, float]]
    """The hidden true values, by name."""
    unit: str
    """Unit of the metric."""


@dataclasses.dataclass(frozen=True, eq=False)
class Remainder(Record):
    """What is left of the gap beside the effects that are named."""

    against: str
    """The variable that most of what is there goes with; empty where it goes with none."""
    kinds: list[str]
    """Kinds of effects that go with that variable, the most probable first."""
    share: float
    """Share of the excess squared gap."""
    where: str
    """The joint or sensor at which most of it is."""


@dataclasses.dataclass(frozen=True, eq=False)
class Shares(Record):
    """How the excess squared gap is shared out; the sum is 1."""

    learnable: float
    """Left by them, and foretold by a regression on position, speed, load and time."""
    named: float
    """Closed by the verdict's effects."""
    unrepeatable: float
    """Left by both."""


@dataclasses.dataclass(frozen=True, eq=False)
class SignalGap(Record):
    """Gap of one sensor, root mean square in units of its noise."""

    identified: float
    """After fitting the study's own parameters."""
    noise: float
    """Deviation of its noise, in its unit."""
    nominal: float
    """The model as given."""
    refined: float
    """With the verdict's effects."""
    signal: str
    """Sensor."""
    unit: str
    """Unit."""


@dataclasses.dataclass(frozen=True, eq=False)
class StudyParameter(Record):
    """A parameter of the study, as fitted with the verdict's effects."""

    estimate: float
    """Estimate."""
    interval95: Array
    """95 % interval."""
    name: str
    """Name."""
    std: float
    """Deviation."""
    nominal: float | None = None
    """Value in the model as given, where it is known."""
    unit: str | None = None
    """Unit; may be empty."""


@dataclasses.dataclass(frozen=True, eq=False)
class TaskTrial(Record):
    """Runs of a task in one world with one simulator."""

    simulator: str
    """With which simulator."""
    successes: int
    """Runs that succeeded."""
    values: Array
    """The metric of each run, in its unit."""
    world: str
    """In which world."""


@dataclasses.dataclass(frozen=True, eq=False)
class Tolerance(Record):
    """What an ordinary machine has of an effect, as it was fitted beside the verdict's: within its tolerance, and not named."""

    effect: str
    """Name."""
    parameters: dict[str, float]
    """Fitted values."""
    site: str
    """Site; empty for an effect of the whole scene."""


@dataclasses.dataclass(frozen=True, eq=False)
class Verdict(Record):
    """The answer."""

    ambiguous_with: list[list[str]]
    """Rival sets that these data cannot tell from it."""
    effects: list[str]
    """Effects at their sites."""
    kind: VerdictKind
    """What kind."""
    probability: float
    """Probability of it; of effects, that all of them are among the true ones."""
    remainder: Remainder | None
    """What is left beside the effects that are named; `None` where nothing is, or none is named."""
    unexplained: float
    """Share of the excess squared gap that it leaves."""


@dataclasses.dataclass(frozen=True, eq=False)
class Wiring(Record):
    """A fault of wiring: columns of the logs that do not mean what their names say."""

    columns: list[str]
    """Sensors or `ctrl.<actuator>` concerned."""
    fault: str
    """`wiring-swapped`, `wiring-sign`, `wiring-unit`, `wiring-offset` or `wiring-clock`."""
    mend: str
    """Lines for the study file."""
    probability: float
    """Probability against the wiring as given."""


@dataclasses.dataclass(frozen=True, eq=False)
class Diagnosis(Result):
    """`result.json`."""

    checks: list[Check]
    """Checks."""
    effects: list[Effect]
    """Effects of the hypotheses."""
    gap: Gap
    """Gaps."""
    groups: list[Group]
    """Effects of the verdict that are one law at several sites."""
    hypotheses: list[Hypothesis]
    """Probabilities, most probable first."""
    next_experiment: NextExperiment
    """What to do next."""
    not_tried: list[NotTried]
    """What a time limit or an interruption left out; empty where the search came to its end."""
    parameters: list[StudyParameter]
    """The study's parameters."""
    schema: int
    """1."""
    sentence: str
    """The answer in one sentence."""
    study: str
    """Name of the study."""
    verdict: Verdict
    """The answer."""
    where: list[Place]
    """Where the gap of the identified model lies, largest share first."""
    wiring: list[Wiring]
    """Faults of wiring; everything else is said of the study after their mending."""
    calibration: Calibration | None = None
    """What the diagnosis says of simulated logs; `None` where that was not asked."""
    detection_limits: list[DetectionLimit] = dataclasses.field(default_factory=list)
    """The smallest size of each effect that these logs could have shown."""
    isolability: Isolability | None = None
    """Which of the leading effects these logs tell apart; `None` where none leads."""
    missing_force: list[MissingForce] = dataclasses.field(default_factory=list)
    """The force that is missing at each degree of freedom; empty where contact lasts, and it is not estimated."""
    ranking: list[RankedSet] = dataclasses.field(default_factory=list)
    """Sets of effects by their evidence, the best first, at most 20."""
    real_world: RealWorldTrials | None = None
    """The task in the real world, before and after; `None` for a study."""
    seconds: float | None = None
    """Wall time of the diagnosis, s."""
    seconds_to_first_table: float | None = None
    """Wall time until the first ranking was known, s."""
    tolerances: list[Tolerance] = dataclasses.field(default_factory=list)
    """What an ordinary machine has of effects, fitted and not named; empty where what is named does without."""


@dataclasses.dataclass(frozen=True, eq=False)
class Best(Record):
    """Whether a row is the best of its column, with an interval apart from the others'."""

    iqm: bool
    """In the interquartile mean of the metric."""
    success: bool
    """In the share of successes."""


@dataclasses.dataclass(frozen=True, eq=False)
class CellCount(Record):
    """What is asked of a comparison, and how much of it there is."""

    done: int
    """Cells that are there."""
    planned: int
    """Cells of the plan."""


@dataclasses.dataclass(frozen=True, eq=False)
class ComparisonRow(Record):
    """One row of the table."""

    backend: str
    """Engine of the simulator."""
    best: Best
    """Whether it is the best of its column."""
    commit: str
    """Commit."""
    condition: str
    """Condition."""
    differs: list[str]
    """What makes the row unequal to others of its task, condition, world and engine."""
    explorer: str
    """Explorer, or `none`."""
    identification: list[IdentifiedUnknown]
    """How well the unknowns were identified; empty without identification."""
    identifier: str
    """Identifier, `none`, or `truth`."""
    improvement: Improvement | None
    """Against the next best method; none of the last one, of the oracle, and of one alone."""
    interval95: Array
    """Bootstrap interval of the mean."""
    iqm: float
    """Interquartile mean."""
    iqm_interval95: Array
    """Bootstrap interval of the interquartile mean."""
    mean: float
    """Mean of the metric."""
    median: float
    """Median."""
    method: str
    """Method."""
    metric: str
    """The task's metric; lower is better."""
    n: int
    """Runs."""
    paper: float | None
    """The paper's value, as a share where it counts successes."""
    published: Published | None
    """Where that value stands in the paper and what it measures."""
    seeds: list[int]
    """Seeds of the runs."""
    settings: str
    """Hash of the settings."""
    solver: str
    """Solver."""
    std: float
    """Sample standard deviation."""
    success_interval95: Array
    """Its Wilson interval."""
    success_rate: float
    """Share of successes."""
    task: str
    """Task."""
    values: Array
    """Values of the metric, by seed."""
    world: str
    """Kind of real world."""


@dataclasses.dataclass(frozen=True, eq=False)
class FailedRun(Record):
    """Why a cell is not there."""

    backend: str
    """Engine of the method's simulator."""
    condition: str
    """Condition of the task."""
    method: str
    """Name of the method."""
    of_all: bool
    """Whether no cell of this method, task, world and engine can be run, rather than this one."""
    reason: str
    """Why, in one line."""
    seed: int
    """Seed."""
    task: str
    """Task."""
    world: str
    """Kind of real world."""


@dataclasses.dataclass(frozen=True, eq=False)
class IdentifiedUnknown(Record):
    """How well one unknown was identified over the runs of a row."""

    coverage95: float
    """Share of 95 % intervals that hold the truth."""
    median_abs_error: float
    """Median distance of the estimate from the truth."""
    median_expected_std: float | None
    """Median of the expected posterior standard deviations."""
    median_width95: float
    """Median width of the 95 % intervals."""
    name: str
    """Name."""
    unit: str
    """Unit."""


@dataclasses.dataclass(frozen=True, eq=False)
class Improvement(Record):
    """Probability that a run is better than one of the next best method."""

    interval95: Array
    """Its 95 % bootstrap interval."""
    over: str
    """The next best method."""
    probability: float
    """Probability; ties count half."""


@dataclasses.dataclass(frozen=True, eq=False)
class Omitted(Record):
    """A method that could not be run at all on a task."""

    backend: str
    """Engine of the simulator."""
    method: str
    """Method."""
    reason: str
    """Why."""
    task: str
    """Task."""
    world: str
    """Kind of real world."""


@dataclasses.dataclass(frozen=True, eq=False)
class PooledRow(Record):
    """A method over all conditions of a task, each condition a stratum."""

    backend: str
    """Engine of the simulator."""
    best: Best
    """Whether it is the best of its column."""
    conditions: list[str]
    """Conditions that are pooled."""
    improvement: Improvement | None
    """Against the next best method; none of the last one, of the oracle, and of one alone."""
    interval95: Array
    """Bootstrap interval of the mean."""
    iqm: float
    """Interquartile mean."""
    iqm_interval95: Array
    """Bootstrap interval of the interquartile mean."""
    mean: float
    """Mean of the metric."""
    median: float
    """Median."""
    method: str
    """Method."""
    metric: str
    """The task's metric."""
    n: int
    """Runs."""
    std: float
    """Sample standard deviation."""
    success_interval95: Array
    """Its Wilson interval."""
    success_rate: float
    """Share of successes."""
    task: str
    """Task."""
    world: str
    """Kind of real world."""


@dataclasses.dataclass(frozen=True, eq=False)
class Published(Record):
    """A published value."""

    attempts: int | None
    """Attempts, where the paper counts successes."""
    measure: Measure
    """What is measured."""
    std: float | None
    """What stands behind ± in the paper, where something does."""
    table: int
    """Number of the paper's table."""
    value: float
    """Value."""


@dataclasses.dataclass(frozen=True, eq=False)
class Comparison(Result):
    """`result.json` of a comparison."""

    cells: CellCount
    """How much there is."""
    failures: list[FailedRun]
    """Single runs that failed."""
    omitted: list[Omitted]
    """Methods that could not be run."""
    pooled: list[PooledRow]
    """A row a task, engine, world and method, where a task has several conditions."""
    quick: bool
    """Whether searches were cut short."""
    rows: list[ComparisonRow]
    """A row a task, condition, engine, world and method."""
    schema: int
    """Layout version."""
    table: int | None
    """The paper's table that this is; none for a comparison of one's own."""
    versions: Any
    """What made the cells."""
