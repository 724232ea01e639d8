"""Controller tuning: Ziegler-Nichols, relay, constrained optimisation; forms and stability of what comes out."""

from .criteria import StepFigures, error_index, step_figures
from .errors import TuningError
from .forms import continuous_pi, discrete_pi, error_scale, fuzzy_slopes, fuzzy_steepest, linear, printed, texts
from .optimise import KNOBS, Tuning, crossed, optimise
from .problem import Experiment, Goal, Trial, usual_experiment
from .relay import RelayConfig, RelayOutcome, RelayState, RelayTuner
from .relay_experiment import RelayExperiment, RelayExperimentState, RelayOutput, run_relay
from .stability import SlowPole, Stability, continuous_path, open_loop, sampled_path, stability
from .usual import usual_goal, usual_relay
from .ziegler_nichols import UltimatePoint, settings, tuned, ultimate_point

__all__ = [
    "KNOBS",
    "Experiment",
    "Goal",
    "RelayConfig",
    "RelayExperiment",
    "RelayExperimentState",
    "RelayOutcome",
    "RelayOutput",
    "RelayState",
    "RelayTuner",
    "SlowPole",
    "Stability",
    "StepFigures",
    "Trial",
    "Tuning",
    "TuningError",
    "UltimatePoint",
    "continuous_path",
    "continuous_pi",
    "crossed",
    "discrete_pi",
    "error_index",
    "error_scale",
    "fuzzy_slopes",
    "fuzzy_steepest",
    "linear",
    "open_loop",
    "optimise",
    "printed",
    "run_relay",
    "sampled_path",
    "settings",
    "stability",
    "step_figures",
    "texts",
    "tuned",
    "ultimate_point",
    "usual_experiment",
    "usual_goal",
    "usual_relay",
]
