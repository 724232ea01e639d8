"""The snapshot of parameters among answers that are lost, late, or short."""

from types import SimpleNamespace

import pytest
from rclpy.parameter import Parameter

from dt_station_nodes.nodes import parameter_snapshot
from dt_station_nodes.nodes.parameter_snapshot import ParameterSnapshot


class Question:
    """What a client was asked, and its answer when the test gives it."""

    def __init__(self, kind, names):
        self.kind, self.names = kind, names

    def add_done_callback(self, callback):
        self._callback = callback

    def result(self):
        return self._answer

    def answer(self, answer):
        self._answer = answer
        self._callback(self)


class Bench:
    """The recorder's node, a node `twin` with parameters of its own, and a clock that the test turns."""

    def __init__(self, monkeypatch, **parameters):
        self.now, self.asked, self.kept = 100.0, [], {}
        self.parameters = parameters
        monkeypatch.setattr(parameter_snapshot.time, "monotonic", lambda: self.now)
        self.snapshot = ParameterSnapshot(self, self.kept.__setitem__)

    def create_timer(self, *_, **__):
        return None

    def get_namespace(self):
        return "/station"

    def get_node_names_and_namespaces(self):
        return [("twin", "/station"), ("other", "/elsewhere")]

    def create_client(self, _, name):
        return SimpleNamespace(
            service_is_ready=lambda: True,
            call_async=lambda request: self._note(name.rsplit("/", 1)[1], list(getattr(request, "names", ()))),
        )

    def _note(self, kind, names):
        self.asked.append(Question(kind, names))
        return self.asked[-1]

    def look(self, after_s=0.0):
        self.now += after_s
        self.snapshot._look()

    def begin(self):
        """A node is not asked before it can know who asks."""
        self.look()
        assert not self.asked
        self.look(0.4)

    def respond(self, question=None):
        """As rclpy does: a parameter without a value empties the answer."""
        question = self.asked[-1] if question is None else question
        if question.kind == "list_parameters":
            question.answer(SimpleNamespace(result=SimpleNamespace(names=list(self.parameters))))
            return
        values = [self.parameters[name] for name in question.names]
        if None in values:
            values = []
        question.answer(SimpleNamespace(values=[Parameter("x", value=v).to_parameter_msg().value for v in values]))


@pytest.fixture
def bench(monkeypatch):
    return Bench(monkeypatch, model="paper", sample_time_s=0.02, limits=[1.0, 2.0])


def test_all_parameters_come_in_one_answer(bench):
    bench.begin()
    bench.respond()
    bench.respond()
    assert bench.kept == {"twin": {"limits": [1.0, 2.0], "model": "paper", "sample_time_s": 0.02}}
    bench.look(5.0)
    assert len(bench.asked) == 2


def test_what_was_lost_is_asked_again(bench):
    bench.begin()
    bench.look(0.5)
    assert len(bench.asked) == 1
    bench.look(1.0)
    assert [q.kind for q in bench.asked] == ["list_parameters"] * 2
    bench.respond()
    bench.look(1.5)
    bench.respond()
    assert set(bench.kept["twin"]) == {"limits", "model", "sample_time_s"}


def test_a_parameter_without_a_value_costs_no_other(bench):
    bench.parameters["nothing"] = None
    bench.begin()
    for _ in range(6):
        bench.respond()
    assert bench.kept["twin"] == {"limits": [1.0, 2.0], "model": "paper", "sample_time_s": 0.02}


def test_answers_that_come_late_never_leave_a_hole(bench):
    bench.parameters["nothing"] = None
    bench.begin()
    late_list = bench.asked[-1]
    bench.look(1.5)
    bench.respond()
    late_all = bench.asked[-1]
    bench.look(1.5)
    bench.respond()
    bench.respond(late_list)
    bench.respond(late_all)
    while "twin" not in bench.kept:
        late = bench.asked[-1]
        bench.look(1.5)
        bench.respond()
        bench.respond(late)
    assert set(bench.kept["twin"]) == {"limits", "model", "sample_time_s"}
