"""MCAP records as bytes, and the section that ends a file. Format: https://mcap.dev/spec."""

import struct
import zlib
from collections.abc import Sequence

import numpy as np
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Footer, McapRecord, SummaryOffset

from .mcapscan import MAGIC

_MESSAGE_INDEX = struct.Struct("<BQHI")


def packed(record: McapRecord) -> bytes:
    """A record as its bytes."""
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())


def message_index(channel: int, entries: Sequence[tuple[int, int]]) -> bytes:
    """The record that says at which offsets of the chunk before it a channel's messages (log time, ns) lie."""
    body = np.array(entries, dtype="<u8").tobytes()
    return _MESSAGE_INDEX.pack(Opcode.MESSAGE_INDEX, 6 + len(body), channel, len(body)) + body


def summary(groups: Sequence[Sequence[McapRecord]], start: int) -> bytes:
    """Summary section, footer and magic for a data section that ends at `start`; one opcode a group."""
    body, offsets = b"", b""
    for records in groups:
        group = b"".join(map(packed, records))
        if group:
            offsets += packed(SummaryOffset(group[0], start + len(body), len(group)))
        body += group
    footer = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, start + len(body))
    crc = zlib.crc32(body + offsets + footer)
    return body + offsets + packed(Footer(start, start + len(body), crc)) + MAGIC
