"""Reruns: identical to the last bit, or the first sample that is not; what the bag does not say is found by trying."""

import math
from dataclasses import dataclass, field

from dt_station_nodes.records.rerun import Change, Output, Rerun, same


@dataclass
class Counter:
    """A machine whose output is a running sum with a gain; state is (sum, gain)."""

    outputs: dict[int, float]
    count: int = 300
    inputs: list[float] = field(default_factory=lambda: [0.1 * math.sin(i) for i in range(300)])

    def initial(self) -> tuple[float, float]:
        return 0.0, 1.0

    def step(self, state: tuple[float, float], i: int) -> tuple[tuple[float, float], Output | None]:
        total = state[0] + self.inputs[i] * state[1]
        return (total, state[1]), (total,)

    def recorded(self, i: int) -> Output | None:
        return (self.outputs[i],) if i in self.outputs else None


def played(changes: dict[int, float] | None = None, restarts: tuple[int, ...] = ()) -> dict[int, float]:
    machine = Counter({})
    state, outputs = machine.initial(), {}
    for i in range(machine.count):
        if i in restarts:
            state = machine.initial()
        if changes and i in changes:
            state = (state[0], changes[i])
        state, output = machine.step(state, i)
        assert output is not None
        outputs[i] = output[0]
    return outputs


def gain(value: float, likely: int, spread: int = 20) -> Change[tuple[float, float]]:
    return Change(likely - spread, likely, likely + spread, lambda state: (state[0], value), f"gain {value}")


def test_the_same_inputs_give_the_same_outputs() -> None:
    outcome = Rerun(Counter(played()), []).run()
    assert (outcome.compared, outcome.differs, outcome.notes) == (300, -1, ())


def test_one_bit_is_found() -> None:
    outputs = played()
    outputs[123] = math.nextafter(outputs[123], 1.0)
    outcome = Rerun(Counter(outputs), []).run()
    assert outcome.differs == 123
    assert outcome.compared == 123
    assert outcome.computed == (played()[123],)


def test_a_change_is_placed_where_it_acted() -> None:
    outcome = Rerun(Counter(played({100: 2.0, 200: 0.5})), [gain(2.0, 93), gain(0.5, 210)]).run()
    assert outcome.differs == -1
    assert outcome.compared == 300
    assert outcome.notes == ("gain 2.0 from sample 100 on", "gain 0.5 from sample 200 on")


def test_changes_close_together() -> None:
    outcome = Rerun(Counter(played({100: 2.0, 104: 0.5})), [gain(2.0, 101), gain(0.5, 102)]).run()
    assert outcome.differs == -1


def test_a_change_that_never_acted_is_found() -> None:
    outcome = Rerun(Counter(played()), [gain(2.0, 100)]).run()
    assert outcome.differs >= 0


def test_missing_outputs_are_passed_over() -> None:
    outputs = {i: value for i, value in played().items() if not 50 <= i < 60}
    outcome = Rerun(Counter(outputs), []).run()
    assert outcome.differs == -1
    assert outcome.compared == 290
    assert "answered, but not recorded" in outcome.notes[0]


def test_a_node_killed_and_restarted_is_recognised() -> None:
    outputs = {i: value for i, value in played(restarts=(60,)).items() if not 50 <= i < 60}
    outcome = Rerun(Counter(outputs), []).run()
    assert outcome.differs == -1
    assert "a new start" in outcome.notes[0]


def test_a_restart_between_two_samples_is_recognised() -> None:
    outcome = Rerun(Counter(played(restarts=(60,))), []).run()
    assert outcome.differs == -1
    assert outcome.notes == ("started anew at sample 60",)


def test_zero_and_minus_zero_differ_and_not_a_number_is_one() -> None:
    assert not same((0.0,), (-0.0,))
    assert same((math.nan, 1.0), (-math.nan, 1.0))
    assert not same((1.0,), (1.0, 2.0))
