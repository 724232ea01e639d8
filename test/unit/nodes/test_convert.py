"""Our bytes against rclpy's own serialization, both ways."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message

from dt_station_msgs import msg
from dt_station_nodes.core.samples import ControlMode, PlantSample, SampleFlag, Setpoint, ValveCommand
from dt_station_nodes.nodes import convert

FINITE = st.floats(allow_nan=False)
STAMPS = st.integers(0, 2**31 * 10**9 - 1)
NUMBERS = st.integers(0, 2**63)


def filled(message, stamp_ns, frame_id="", **fields):
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 10**9)
    message.header.frame_id = frame_id
    for name, value in fields.items():
        setattr(message, name, value)
    return message


@settings(max_examples=60, deadline=None)
@given(NUMBERS, STAMPS, FINITE, FINITE, st.integers(0, 127), st.text("abcdefgh/", max_size=30))
def test_a_plant_state_of_any_writer_is_read_and_ours_is_read_by_rclpy(
    sequence, stamp, position, pressure, flags, frame
):
    sample = PlantSample(sequence, stamp, position, pressure, 1.5, -2.5, SampleFlag(flags))
    fields = {"sequence": sequence, "position": position, "pressure": pressure, "load_voltage": 1.5}
    theirs = filled(msg.PlantState(), stamp, frame, servo_voltage=-2.5, flags=flags, **fields)
    assert convert.state_from_bytes(serialize_message(theirs)) == sample
    assert deserialize_message(convert.state_to_bytes(sample), msg.PlantState) == filled(theirs, stamp)
    assert convert.state_from_bytes(convert.state_to_bytes(sample)) == sample
    assert convert.sequence_of(convert.state_to_bytes(sample)) == sequence


def test_the_others_are_read_and_written_too():
    setpoint = Setpoint(7, 20_000_001, 2.5e6, True)
    theirs = filled(msg.Setpoint(), 20_000_001, "x", sequence=7, value=2.5e6, streaming=True)
    assert convert.setpoint_from_bytes(serialize_message(theirs)) == setpoint
    assert deserialize_message(convert.setpoint_to_bytes(setpoint), msg.Setpoint) == filled(theirs, 20_000_001)

    command = ValveCommand(7, 5, -3.25, 0.01, ControlMode.FUZZY, True)
    theirs = filled(msg.ValveCommand(), 5, sequence=7, voltage=-3.25, setpoint=0.01, mode=3, limited=True)
    assert convert.command_from_bytes(serialize_message(theirs)) == command
    assert deserialize_message(convert.command_to_bytes(command), msg.ValveCommand) == theirs

    residual = convert.ResidualSample(7, 5, (1.0, 2.0, 3.0, 4.0), (5.0, 6.0, 7.0, 8.0))
    theirs = deserialize_message(convert.residual_to_bytes(residual), msg.Residual)
    assert (theirs.position_residual, theirs.position_fit, theirs.pressure_ise) == (1.0, 4.0, 6.0)
    assert convert.residual_from_bytes(serialize_message(theirs)) == residual


def test_padding_across_processes_does_no_harm_and_bytes_do_not_depend_on_leftovers():
    setpoint = Setpoint(1, 2, 3.0, False)
    data = convert.setpoint_to_bytes(setpoint)
    assert convert.setpoint_from_bytes(data + b"\xff\xff\xff") == setpoint
    assert data == convert.setpoint_to_bytes(setpoint)


def test_big_endian_writers_are_understood():
    little = convert.command_to_bytes(ValveCommand(258, 0, 1.0, 2.0, ControlMode.PID, False))
    wire = convert._COMMAND
    big = b"\0\0\0\0" + bytes(8) + b"\0\0\0\1" + bytes(4) + wire._big.pack(258, 1.0, 2.0, 2, False)
    assert convert.command_from_bytes(big) == convert.command_from_bytes(little)


def test_torn_bytes_and_unknown_modes_do_not_pass_as_numbers():
    with pytest.raises(convert.WireError, match="too few"):
        convert.state_from_bytes(b"\0\1\0\0")
    theirs = filled(msg.ValveCommand(), 0, mode=77, voltage=math.nan)
    assert convert.command_from_bytes(serialize_message(theirs)).mode is ControlMode.MANUAL
