"""What a user means who says nothing: the goal and the relay that suit each channel."""

from ...core.channels import Channel
from ...core.models import ModelSpec
from .problem import Goal
from .relay import RelayConfig
from .stability import continuous_path

PHASE_MARGIN_DEG = {Channel.PRESSURE: 45.0, Channel.POSITION: 35.0}


def usual_goal(channel: Channel) -> Goal:
    """The position loop is judged at 35 degrees: the published PID has 31.8, and 45 would leave it slower."""
    return Goal(phase_margin_deg=PHASE_MARGIN_DEG[channel])


def usual_relay(model: ModelSpec, channel: Channel) -> RelayConfig:
    """Small swings well inside the valves' ranges, around 2.5 MPa or around where the piston stands."""
    if channel is Channel.POSITION:
        return RelayConfig(
            setpoint=0.0, bias_v=0.0, amplitude_v=2.0, hysteresis=2.0e-4, lowest=-0.05, highest=0.05, timeout_s=60.0
        )
    path = model.paths[channel]
    middle = 2.5e6
    gain = float(abs(continuous_path(model, channel).dcgain())) * path.scale
    return RelayConfig(
        setpoint=middle,
        bias_v=(middle - path.rest) / gain,
        amplitude_v=0.5,
        hysteresis=2.0e4,
        lowest=0.0,
        highest=6.0e6,
        approach_s=3.0,
        timeout_s=60.0,
    )
