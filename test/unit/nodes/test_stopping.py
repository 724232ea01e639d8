"""A wish to stop waits for what must not be cut short, and is not forgotten."""

import signal

import pytest

from dt_station_nodes.nodes.stopping import StopSignal, uninterrupted

BOTH = (signal.SIGINT, signal.SIGTERM)


def hearing(sent: signal.Signals, done: list[str], error: Exception | None = None) -> None:
    with uninterrupted():
        signal.raise_signal(sent)
        done.append("after the signal")
        if error is not None:
            raise error


@pytest.mark.parametrize("sent", BOTH)
def test_a_wish_is_granted_at_the_end_and_the_handlers_are_as_before(sent: signal.Signals) -> None:
    before = [signal.getsignal(each) for each in BOTH]
    done: list[str] = []
    with pytest.raises(KeyboardInterrupt):
        hearing(sent, done)
    assert done
    assert [signal.getsignal(each) for each in BOTH] == before


def test_without_a_wish_nothing_is_raised() -> None:
    with uninterrupted():
        pass


def test_an_error_inside_is_the_error() -> None:
    with pytest.raises(ValueError, match="inside"):
        hearing(signal.SIGTERM, [], ValueError("inside"))


def test_a_loop_sees_the_wish() -> None:
    with StopSignal() as stop:
        assert not stop.wanted
        signal.raise_signal(signal.SIGINT)
        assert stop.wanted
