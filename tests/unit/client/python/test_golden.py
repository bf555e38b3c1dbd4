# SPDX-License-Identifier: Apache-2.0
"""The golden messages and conversation of proto/golden, as a program in any language reads them."""
import json
import os
import pathlib
import sys

import grpc
import pytest
from google.protobuf import json_format

from warmfront._contacts import AnswerPart, parse_response
from warmfront.v1 import session_pb2, step_pb2

GOLDEN = pathlib.Path(os.environ["WARMFRONT_SOURCE"]) / "proto" / "golden"
sys.path.insert(0, str(GOLDEN))

import encode  # noqa: E402

MESSAGES = json.loads((GOLDEN / "messages.json").read_text())
CONVERSATION = json.loads((GOLDEN / "conversation.json").read_text())["conversation"]
KINDS = {
    "CreateSession": (session_pb2.CreateSessionRequest, session_pb2.CreateSessionResponse),
    "StreamSteps": (step_pb2.StreamStepsRequest, step_pb2.StreamStepsResponse),
    "DeleteSession": (session_pb2.DeleteSessionRequest, session_pb2.DeleteSessionResponse),
}


@pytest.mark.parametrize("entry", MESSAGES, ids=lambda entry: entry["what"])
def test_bytes_and_json_say_the_same(entry):
    message = encode.message_of(entry)
    assert message.SerializeToString(deterministic=True).hex() == entry["hex"]
    assert type(message).FromString(bytes.fromhex(entry["hex"])) == message


def test_this_client_reads_answers_as_protobuf_does():
    seen = 0
    for entry in MESSAGES:
        if entry["message"] != "StreamStepsResponse":
            continue
        message = encode.message_of(entry)
        parsed = parse_response(bytes.fromhex(entry["hex"]))
        if not isinstance(parsed, AnswerPart):
            assert parsed == message
            continue
        answer = message.answer
        seen += 1
        assert (parsed.frame, parsed.last, parsed.summary) == (answer.frame, answer.last, answer.summary)
        for name, column in parsed.columns.items():
            assert column.tobytes() == getattr(answer.contacts, name)
        assert set(parsed.columns) == {field.name for field, value in answer.contacts.ListFields() if value}
        assert (b"" if parsed.distances is None else parsed.distances.tobytes()) == answer.vertex_distances
    assert seen >= 3


def expect(message, stated, where):
    """What the conversation states is so; what it does not may be anything."""
    expect_fields(message, json_format.ParseDict(stated, type(message)()), where)


def expect_fields(message, stated, where):
    for field, value in stated.ListFields():
        actual = getattr(message, field.name)
        if field.message_type is None or field.label == field.LABEL_REPEATED:
            assert actual == value, f"{where}.{field.name}"
        else:
            assert message.HasField(field.name), f"{where}.{field.name}"
            expect_fields(actual, value, f"{where}.{field.name}")


def test_the_daemon_holds_the_conversation(start_daemon):
    daemon = start_daemon()
    with grpc.insecure_channel(daemon.address) as channel:
        grpc.channel_ready_future(channel).result(timeout=30)
        for call in CONVERSATION:
            request, response = KINDS[call["call"]]
            method = f"/warmfront.v1.CollisionService/{call['call']}"
            requests = [json_format.ParseDict(sent, request()) for sent in call.get("requests", [])]
            if call["call"] == "CreateSession":
                expect(channel.stream_unary(method, request.SerializeToString, response.FromString)(iter(requests), timeout=30),
                       call["response"], "CreateSession")
            elif call["call"] == "StreamSteps":
                exchange(channel.stream_stream(method, request.SerializeToString, response.FromString), request, call["exchange"])
            else:
                expect(channel.unary_unary(method, request.SerializeToString, response.FromString)(requests[0], timeout=30),
                       call["response"], call["call"])


def exchange(method, request, steps):
    answers = method((json_format.ParseDict(step["send"], request()) for step in steps), timeout=30)
    for step in steps:
        if "receive" in step:
            expect(next(answers), step["receive"], json.dumps(step["send"])[:60])
    assert next(answers, None) is None
