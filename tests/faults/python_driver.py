# SPDX-License-Identifier: Apache-2.0
"""Drives a session of the Python client for python_driver.cpp: a JSON object a line in, one a line out. Arrays travel as
hexadecimal text of their little-endian bytes, so that no bit is lost."""
import json
import sys

import numpy as np

import warmfront

TIMEOUTS = warmfront.Timeouts(call=20, create=60, answer=60, resume=60, resumes_without_answer=1000)


def array(text, dtype, *shape):
    values = np.frombuffer(bytearray.fromhex(text), dtype)
    return values.reshape(shape) if shape else values


def rows(text):
    """(n, 3); what is no such array stays flat, and is refused."""
    values = array(text, "<f8")
    return values.reshape(-1, 3) if values.size % 3 == 0 else values


def body_of(body):
    return warmfront.Body(body["vertex_count"], body["kind"], name=body["name"], first_vertex=body["first_vertex"],
                          self_collision=body["self_collision"], group=body["group"], mask=body["mask"],
                          thickness=body["thickness"], world=body["world"], screw=body["screw"],
                          half_space=body["half_space"] and [array(three, "<f8") for three in body["half_space"]])


def frame_of(frame):
    for parts in (frame["bodies"], frame["poses"]):
        if len({one["body"] for one in parts}) < len(parts):
            return {"bodies": {-1: []}}  # a body is given twice, which a dict cannot say: this is as wrong
    said = {"positions": rows(frame["all"])} if "all" in frame else {}
    if frame["bodies"]:
        said["bodies"] = {one["body"]: rows(one["positions"]) for one in frame["bodies"]}
    if frame["poses"]:
        said["poses"] = {one["body"]: array(one["pose"], "<f8", 3, 4) for one in frame["poses"]}
    if frame["vertices"]:
        said["vertices"] = array(frame["vertices"], "<u4")
        said["vertex_positions"] = rows(frame["vertex_positions"])
    return said


COLUMNS = ("kind", "status", "v", "toi", "weights", "normal", "points", "direction", "squared_distance", "closest",
           "multiplicity", "stencil")


def hex_of(number):
    return np.float64(number).tobytes().hex()


def told(answer, answer_toi=0.0):
    if isinstance(answer, warmfront.MaxStep):
        # As the trial that it is, of which it tells the first contact.
        first = answer.first
        columns = {name: "" for name in COLUMNS}
        if first is None:
            return {"frame": 0, "vf": 0, "ee": 0, "possible": 0, **columns}
        columns.update(kind=f"{first.kind:02x}", status=f"{first.status:02x}", v=np.array(first.v, "<u4").tobytes().hex(),
                       toi=hex_of(first.toi))
        return {"frame": 0, "vf": 0, "ee": 0, "possible": 0, "earliest_toi": hex_of(answer.fraction), **columns}
    if isinstance(answer, warmfront.Committed):
        result = {"frame": answer.frame, "fraction": hex_of(answer.fraction)}
        result.update((name, getattr(answer, name)) for name in ("vf", "ee", "vh", "possible") if getattr(answer, name) is not None)
        if answer.earliest_toi is not None:
            result["earliest_toi"] = hex_of(answer.earliest_toi)
        return result
    if isinstance(answer, warmfront.Intersections):
        # Rows of an edge and a face, whose kind, status and time are always the same: `toi` is put in by the asker.
        k = len(answer)
        columns = {name: "" for name in COLUMNS}
        columns.update(kind="02" * k, status="01" * k, toi=hex_of(answer_toi) * k)
        return {"frame": answer.frame, "vf": 0, "ee": 0, "ef": answer.count, "possible": 0, **columns,
                "edge_faces": np.hstack([answer.edges, answer.faces]).astype("<u4").tobytes().hex()}
    if isinstance(answer, warmfront.VertexDistances):
        return {"frame": answer.frame, "vf": answer.vf, "ee": answer.ee, "vh": answer.vh, "possible": answer.possible,
                **{name: "" for name in COLUMNS}, "vertex_distances": answer.distances.tobytes().hex()}
    result = {"frame": answer.frame, "vf": answer.vf, "ee": answer.ee, "vh": answer.vh, "possible": answer.possible}
    if answer.earliest_toi is not None:
        result["earliest_toi"] = hex_of(answer.earliest_toi)
    for name in COLUMNS:
        column = getattr(answer, name)
        result[name] = "" if column is None else column.tobytes().hex()
    return result


class Driver:
    def create(self, request):
        self.session = None
        client = warmfront.connect(request["address"], timeouts=TIMEOUTS)
        options = warmfront.Options(**request["options"])
        self.session = client.session(
            rows(request["positions"]), array(request["faces"], "<i4", -1, 3),
            edges=array(request["edges"], "<i4", -1, 2), bodies=[body_of(b) for b in request["bodies"]],
            excluded_pairs=[tuple(pair) for pair in request["excluded_pairs"]], options=options,
            thickness=array(request["thickness"], "<f8") if request["thickness"] else None)
        return {"id": self.session.id, "window": self.session.window}

    def step(self, request):
        return told(self.session.step(**frame_of(request), **request.get("question", {})))

    def place(self, request):
        self.session.place(**frame_of(request))
        return {"frame": 0, "vf": 0, "ee": 0, "possible": 0, **{name: "" for name in COLUMNS}}

    def trial(self, request):
        return told(self.session.trial(**frame_of(request), **request.get("question", {})))

    def max_step(self, request):
        return told(self.session.max_step(**frame_of(request), **request.get("question", {})))

    def proximity(self, request):
        question = request["question"]
        # Of these, proximity() takes what has a meaning there.
        if "tolerance" in question:
            del question["tolerance"]
        if question.pop("tangled", False):
            return told(self.session.intersections(**question), 1.0 if question["where"] == "trial_end" else 0.0)
        if question.get("report") == "vertex-distances":
            del question["report"]
            question.pop("max_contacts", None)
            return told(self.session.vertex_distances(array(request["distance"], "<f8")[0], **question))
        return told(self.session.proximity(array(request["distance"], "<f8")[0], **question))

    def commit(self, request):
        return told(self.session.commit(array(request["fraction"], "<f8")[0]))

    def submit(self, request):
        """Of any kind: "kind", with a frame or, of a commit, a fraction."""
        kind = request.get("kind", "step")
        if kind == "commit":
            return {"frame": self.session.submit(kind=kind, fraction=array(request["fraction"], "<f8")[0])}
        return {"frame": self.session.submit(**frame_of(request), kind=kind, **request.get("question", {}))}

    def next_answer(self, request):
        return told(self.session.next_answer())

    def add_body(self, request):
        return {"index": self.session.add_body(body_of(request["body"]), array(request["faces"], "<i4", -1, 3),
                                               rows(request["positions"]), array(request["edges"], "<i4", -1, 2),
                                               array(request["thickness"], "<f8") if request["thickness"] else None)}

    def change_body(self, request):
        self.session.change_body(request["index"], body_of(request["body"]))
        return {}

    def change_filters(self, request):
        given = {"rest_positions": rows(request["rest_positions"]), "patches": array(request["patches"], "<u4"),
                 "excluded_vertex_pairs": array(request["excluded_vertex_pairs"], "<u4", -1, 2)}
        self.session.change_filters(warmfront.PairFilters(
            within_edges=request["within_edges"], near_at_rest=array(request["near_at_rest"], "<f8")[0],
            **{name: values for name, values in given.items() if values.size > 0}))
        return {}

    def change_excluded_pairs(self, request):
        self.session.change_excluded_pairs([tuple(pair) for pair in request["pairs"]])
        return {}

    def change_options(self, request):
        self.session.change_options(warmfront.Options(**request["options"]))
        return {}

    def replace_elements(self, request):
        self.session.replace_elements(request["index"], array(request["faces"], "<i4", -1, 3),
                                      array(request["edges"], "<i4", -1, 2))
        return {}

    def replace_body(self, request):
        thickness = array(request["thickness"], "<f8")
        self.session.replace_body(request["index"], rows(request["positions"]), array(request["faces"], "<i4", -1, 3),
                                  array(request["edges"], "<i4", -1, 2), thickness if thickness.size > 0 else None,
                                  body_of(request["body"]))
        return {}

    def state(self, request):
        rigid = [b for b, body in enumerate(self.session.bodies) if body.kind == "rigid"]
        poses = self.session.poses
        assert all(b in rigid for b in poses)
        return {"positions": self.session.positions.tobytes().hex(), "bodies": np.array(rigid, "<u4").tobytes().hex(),
                "poses": b"".join(poses.get(b, np.eye(3, 4)).tobytes() for b in rigid).hex()}

    def close(self, request):
        self.session.close()
        return {}


driver = Driver()
for line in sys.stdin:
    request = json.loads(line)
    try:
        reply = getattr(driver, request["do"])(request)
    except warmfront.WarmfrontError as error:
        reply = {"code": int(error.code), "message": error.message or type(error).__name__}
    print(json.dumps(reply), flush=True)
