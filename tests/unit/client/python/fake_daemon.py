# SPDX-License-Identifier: Apache-2.0
"""A daemon that computes nothing and does what a test says: what it is sent is written down, and any request may be cut off
before it is carried out or after, or be left waiting. Its answers tell the motion that they are of: `earliest_toi` is a hash of
where it began and ended. Whole frames of one message alone. Thread-safe."""
import concurrent.futures
import hashlib
import threading

import grpc
import numpy as np

from warmfront.v1 import errors_pb2, session_pb2, step_pb2

KINDS = {0: "step", 1: "step", 2: "trial", 3: "max_step"}


def motion_hash(start, end):
    """In [0, 1)."""
    content = np.asarray(start, "<f8").tobytes() + np.asarray(end, "<f8").tobytes()
    return int.from_bytes(hashlib.sha256(content).digest()[:6], "little") / 2**48


def part_way(start, end, fraction, dtype):
    """v1.Commit's formula, number by number."""
    if fraction in (0, 1):
        return end if fraction == 1 else start
    rows = [[dtype.type(float(x) + fraction * (float(y) - float(x))) if x != y else y for x, y in zip(a, b)]
            for a, b in zip(start, end)]
    return np.array(rows, dtype)


class Refused(Exception):
    def __init__(self, code, message, reason=0, frame=None):
        detail = errors_pb2.ErrorDetail(reason=reason)
        super().__init__(message)
        self.status = errors_pb2.Status(code=code, message=message)
        self.status.details.add().Pack(detail)
        self.frame = frame


class Copy:
    """A session as this daemon has it."""

    def __init__(self, header, positions):
        self.dtype = np.dtype("<f4" if header.dtype == 1 else "<f8")
        self.at = np.frombuffer(positions, self.dtype).reshape(-1, 3)
        self.trial = None
        self.state = session_pb2.SessionState(frame=header.first_frame, revision=header.first_revision,
                                              digest=self._digest(positions))
        self.before = None
        self.last = None  # the content and answer of what counted last

    @staticmethod
    def _digest(*content):
        return int.from_bytes(hashlib.sha256(repr(content).encode()).digest()[:8], "little")

    def _counts(self, content, at):
        self.before = session_pb2.SessionState()
        self.before.CopyFrom(self.state)
        self.state.frame += 1
        self.state.digest = self._digest(self.state.digest, content)
        self.at = at
        self.trial = None

    def _again(self, frame, content):
        """The cached answer, where it is to this request."""
        if frame == self.state.frame and self.last is not None:
            if self.last[0] == content:
                return self.last[1]
            raise Refused(10, "the frame was answered for other content", errors_pb2.ERROR_REASON_FRAME_CHANGED)
        if frame != self.state.frame + 1:
            raise Refused(9, f"frame {frame}: {self.state.frame + 1} is expected", errors_pb2.ERROR_REASON_FRAME_OUT_OF_ORDER)
        return None

    def _answer(self, frame, start, end):
        answer = step_pb2.StepAnswer(frame=frame, last=True)
        answer.summary.earliest_toi = motion_hash(start, end)
        answer.summary.state_before.CopyFrom(self.state)
        answer.summary.state.CopyFrom(self.state)
        return answer

    def ask(self, frame, ignores_questions=False, keeps_distances=True):
        kind = "step" if ignores_questions else KINDS[frame.question.kind]
        if kind == "step":
            again = self._again(frame.frame, frame.positions)
            if again is not None:
                return again
        elif frame.frame != self.state.frame + 1:
            raise Refused(9, f"frame {frame.frame}: {self.state.frame + 1} is expected",
                          errors_pb2.ERROR_REASON_FRAME_OUT_OF_ORDER)
        self.trial = None
        end = np.frombuffer(frame.positions, self.dtype).reshape(-1, 3)
        if not np.isfinite(end).all():
            raise Refused(3, "positions: is not a number", errors_pb2.ERROR_REASON_INVALID_INPUT)
        answer = self._answer(frame.frame, self.at, end)
        if kind == "max_step" and frame.question.leave_out_overlaps:
            answer.summary.overlaps_at_start = 7
        if keeps_distances and frame.question.HasField("keep_distance"):
            answer.summary.keep_distance = frame.question.keep_distance
        if kind == "step":
            self._counts(frame.positions, end)
            answer.summary.state.CopyFrom(self.state)
            self.last = (frame.positions, answer)
        else:
            self.trial = end
        return answer

    def commit(self, commit):
        again = self._again(commit.frame, commit.fraction)
        if again is not None:
            return again
        if self.trial is None:
            raise Refused(9, "commit: no trial was answered")
        at = part_way(self.at, self.trial, commit.fraction, self.dtype)
        answer = self._answer(commit.frame, self.at, at)
        answer.summary.commit_counted = commit.fraction < 1
        answer.summary.vf = 3
        self._counts(commit.fraction, at)
        answer.summary.state.CopyFrom(self.state)
        self.last = (commit.fraction, answer)
        return answer


class FakeDaemon:
    """received: what came, such as "trial 1" or "commit 1 0.5". disturb: called with these words of each request, it may
    return "cut" (it is not carried out), "lose" (it is carried out, its answer is lost), both of which end the stream,
    "forget" (as "cut", and the session is gone), "drain" (the request is refused, as by a daemon that stops before it has
    computed it, and the session is gone) or "hang". ignores_questions: as a daemon that is older than they are;
    keeps_distances: as one that knows keep_distance. Each resume begins with "attach" in `received`, and "create" where the
    session is made."""

    def __init__(self, folder):
        self.address = f"unix:{folder}/fake.sock"
        self.received = []
        self.disturb = lambda words: None
        self.ignores_questions = False
        self.keeps_distances = True
        self.copies = {}
        self._over = threading.Event()
        self._lock = threading.Lock()
        self._server = grpc.server(concurrent.futures.ThreadPoolExecutor(16))
        methods = {
            "GetServerInfo": grpc.unary_unary_rpc_method_handler(self._info),
            "CreateSession": grpc.stream_unary_rpc_method_handler(self._create),
            "DeleteSession": grpc.unary_unary_rpc_method_handler(self._delete),
            "StreamSteps": grpc.stream_stream_rpc_method_handler(self._steps),
        }
        self._server.add_generic_rpc_handlers([grpc.method_handlers_generic_handler("warmfront.v1.CollisionService", methods)])
        self._server.add_insecure_port(self.address)
        self._server.start()

    def copy(self):
        """The only session."""
        copy, = self.copies.values()
        return copy

    def stop(self):
        self._over.set()
        self._server.stop(None)

    def _info(self, request, context):
        info = session_pb2.GetServerInfoResponse()
        info.limits.max_streams = 64
        return info.SerializeToString()

    def _create(self, requests, context):
        header, positions = None, b""
        for request in map(session_pb2.CreateSessionRequest.FromString, requests):
            header = request.header if request.HasField("header") else header
            positions += request.positions
        with self._lock:
            self.received.append("create")
            copy = self.copies[header.session_id] = Copy(header, positions)
            response = session_pb2.CreateSessionResponse()
            response.session.session_id = header.session_id
            response.session.state.CopyFrom(copy.state)
            return response.SerializeToString()

    def _delete(self, request, context):
        with self._lock:
            self.copies.pop(session_pb2.DeleteSessionRequest.FromString(request).session_id, None)
        return session_pb2.DeleteSessionResponse().SerializeToString()

    def _steps(self, requests, context):
        copy = None
        for request in map(step_pb2.StreamStepsRequest.FromString, requests):
            response = step_pb2.StreamStepsResponse()
            with self._lock:
                words = self._words(request)
                self.received.append(words)
                if request.HasField("attach"):
                    copy = self.copies.get(request.attach.session_id)
                    if copy is None:
                        detail = errors_pb2.Status(code=5, message="no such session")
                        detail.details.add().Pack(errors_pb2.ErrorDetail(reason=errors_pb2.ERROR_REASON_SESSION_NOT_FOUND))
                        context.set_trailing_metadata([("grpc-status-details-bin", detail.SerializeToString())])
                        context.abort(grpc.StatusCode.NOT_FOUND, "no such session")
                    attached = response.attached
                    attached.expected_frame = copy.state.frame + 1
                    attached.limits.window, attached.limits.max_message_bytes = 4, 1 << 20
                    attached.state.CopyFrom(copy.state)
                    if copy.before is not None:
                        attached.state_before.CopyFrom(copy.before)
                    yield response.SerializeToString()
                    continue
                what = self.disturb(words)
                if what == "forget":
                    self.copies.clear()
                if what == "drain":
                    self.copies.clear()
                    drained = Refused(14, "the daemon is draining", errors_pb2.ERROR_REASON_DRAINING)
                    response.error.status.CopyFrom(drained.status)
                    response.error.frame = (request.commit if request.HasField("commit") else request.step).frame
                    yield response.SerializeToString()
                    continue
                if what in ("cut", "forget"):
                    context.abort(grpc.StatusCode.UNAVAILABLE, "cut")
                if what != "hang":
                    try:
                        if request.HasField("commit"):
                            response.answer.CopyFrom(copy.commit(request.commit))
                        else:
                            response.answer.CopyFrom(copy.ask(request.step, self.ignores_questions, self.keeps_distances))
                    except Refused as refused:
                        response.error.status.CopyFrom(refused.status)
                        response.error.frame = (request.commit if request.HasField("commit") else request.step).frame
            if what == "hang":
                while context.is_active() and not self._over.wait(0.01):
                    pass
                return
            if what == "lose":
                context.abort(grpc.StatusCode.UNAVAILABLE, "cut")
            yield response.SerializeToString()

    @staticmethod
    def _words(request):
        if request.HasField("attach"):
            return "attach"
        if request.HasField("commit"):
            return f"commit {request.commit.frame} {request.commit.fraction:g}"
        return f"{KINDS[request.step.question.kind]} {request.step.frame}"
