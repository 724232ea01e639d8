"""Stages run in order, once, and a stopped one is done again."""

import threading

import pytest

from bootstrap.stages import Stage, Stamps, digest, files_digest, run, stale


class Silent:
    def __init__(self):
        self.lines = []

    def started(self, stage):
        self.lines.append(("started", stage.name))

    def line(self, stage, text):
        self.lines.append((stage.name, text))

    def finished(self, stage, seconds):
        self.lines.append(("finished", stage.name))

    def refresh(self):
        pass


@pytest.fixture
def stamps(tmp_path):
    return Stamps(tmp_path / "stamps")


def stage(name, log, needs=(), key="1", error=None):
    def action(show):
        show(f"{name} at work")
        if error is not None:
            raise error
        log.append(name)

    return Stage(name, name, key, action, needs)


def test_each_stage_runs_after_what_it_needs_and_only_once(stamps):
    log, display = [], Silent()
    stages = [stage("a", log), stage("b", log, ("a",)), stage("c", log, ("a",)), stage("d", log, ("b", "c"))]
    run(stale(stages, stamps), stamps, display, lambda: None)
    assert log[0] == "a"
    assert set(log[1:3]) == {"b", "c"}
    assert log[3:] == ["d"]
    assert ("d", "d at work") in display.lines
    assert stale(stages, stamps) == []


def test_a_changed_key_redoes_the_stage_and_what_needs_it(stamps):
    log = []
    run([stage("a", log), stage("b", log, ("a",)), stage("c", log)], stamps, Silent(), lambda: None)
    changed = [stage("a", log, key="2"), stage("b", log, ("a",)), stage("c", log)]
    assert [item.name for item in stale(changed, stamps)] == ["a", "b"]


def test_stages_that_do_not_need_each_other_run_together(stamps):
    meeting = threading.Barrier(2, timeout=20)
    pair = [Stage(name, name, "1", lambda show: meeting.wait() and None) for name in "ab"]
    run(pair, stamps, Silent(), lambda: None)
    assert stale(pair, stamps) == []


@pytest.mark.parametrize("error", [RuntimeError("no disk"), KeyboardInterrupt()], ids=["failed", "interrupted"])
def test_a_stopped_stage_is_done_again_and_no_finished_one(stamps, error):
    log, cancelled = [], []
    first = [stage("a", log), stage("b", log, ("a",), error=error), stage("c", log, ("b",))]
    with pytest.raises(type(error)):
        run(stale(first, stamps), stamps, Silent(), lambda: cancelled.append(True))
    assert cancelled == [True]
    second = [stage("a", log), stage("b", log, ("a",)), stage("c", log, ("b",))]
    run(stale(second, stamps), stamps, Silent(), lambda: None)
    assert log == ["a", "b", "c"]


def test_a_stage_being_redone_has_no_stamp_of_before(stamps):
    log = []
    run([stage("a", log)], stamps, Silent(), lambda: None)
    with pytest.raises(RuntimeError):
        run([stage("a", log, key="2", error=RuntimeError())], stamps, Silent(), lambda: None)
    assert stamps.key("a") is None


@pytest.mark.parametrize("damage", ["", "{", "[]", '{"seconds": 1}', "null"])
def test_a_damaged_stamp_counts_as_none(stamps, damage):
    stamps.folder.mkdir()
    (stamps.folder / "a").write_text(damage)
    assert stamps.key("a") is None


def test_keys_tell_names_contents_and_borders_apart(tmp_path):
    assert digest("ab", "c") != digest("a", "bc")
    (tmp_path / "x").write_text("1")
    before = files_digest(tmp_path, [tmp_path / "x"])
    (tmp_path / "x").write_text("2")
    assert files_digest(tmp_path, [tmp_path / "x"]) != before
    (tmp_path / "x").rename(tmp_path / "y")
    (tmp_path / "y").write_text("1")
    assert files_digest(tmp_path, [tmp_path / "y"]) != before
