#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether the wire contract keeps its rules, and its promises to older clients: contract.py ROOT [--accept]

Compares what protoc reads in ROOT/proto with ROOT/proto/contract.txt, one line for each message, field, enum value and
method of the contract as it was accepted, and exits with 1 if a line is gone or is another one: a number, a name or a
type that changed, which older programs would read as something else. What is new must be accepted with --accept, which
refuses to drop a line. The rules are those of buf's DEFAULT category (buf.build/docs/lint/rules) on names, enums, packages
and services; each finding names the element.
"""

import pathlib
import re
import subprocess
import sys
import tempfile

from google.protobuf import descriptor_pb2

FieldDescriptor = descriptor_pb2.FieldDescriptorProto
LABELS = {FieldDescriptor.LABEL_REPEATED: "repeated "}


def read_contract(root: pathlib.Path) -> descriptor_pb2.FileDescriptorSet:
    protos = sorted((root / "proto" / "warmfront").rglob("*.proto"))
    with tempfile.NamedTemporaryFile() as out:
        subprocess.run(["protoc", "-I", root / "proto", "-o", out.name, *protos], check=True)
        return descriptor_pb2.FileDescriptorSet.FromString(pathlib.Path(out.name).read_bytes())


def type_of(field) -> str:
    if field.type_name:
        return field.type_name.lstrip(".")
    return FieldDescriptor.Type.Name(field.type).removeprefix("TYPE_").lower()


class Contract:
    """The lines of what is there, and what breaks a rule."""

    def __init__(self, files: descriptor_pb2.FileDescriptorSet) -> None:
        self.lines: list[str] = []
        self.findings: list[str] = []
        for file in files.file:
            self._file(file)
        self.lines.sort()

    def _expect(self, holds: bool, name: str, rule: str) -> None:
        if not holds:
            self.findings.append(f"{name}: {rule}")

    def _file(self, file) -> None:
        folder = file.name.rsplit("/", 1)[0]
        self._expect(file.syntax == "proto3", file.name, "is not proto3")
        self._expect(folder.replace("/", ".") == file.package, file.name, f"is not in the folder of its package {file.package}")
        self._expect(bool(re.search(r"\.v\d+$", file.package)), file.name, f"package {file.package} names no version")
        self._expect(bool(re.fullmatch(r"[a-z_]+\.proto", file.name.rsplit("/", 1)[1])), file.name, "is not in lower_snake_case")
        for message in file.message_type:
            self._message(message, file.package)
        for enum in file.enum_type:
            self._enum(enum, file.package)
        for service in file.service:
            self._service(service, file.package)

    def _message(self, message, scope: str) -> None:
        name = f"{scope}.{message.name}"
        if message.options.map_entry:
            return
        self.lines.append(f"message {name}")
        self._expect(bool(re.fullmatch(r"([A-Z][a-z0-9]*)+", message.name)), name, "is not in PascalCase")
        self._expect(not message.extension_range, name, "has extensions")
        for field in message.field:
            place = f"{name}.{field.name}"
            one = ""
            if field.HasField("oneof_index"):
                oneof = message.oneof_decl[field.oneof_index].name
                one = "optional " if field.proto3_optional else f"oneof {oneof} "
            self.lines.append(f"field {place} = {field.number} {LABELS.get(field.label, '')}{one}{type_of(field)}")
            self._expect(bool(re.fullmatch(r"[a-z][a-z0-9]*(_[a-z0-9]+)*", field.name)), place, "is not in lower_snake_case")
            self._expect(field.type != FieldDescriptor.TYPE_GROUP, place, "is a group")
        for nested in message.nested_type:
            self._message(nested, name)
        for enum in message.enum_type:
            self._enum(enum, name)

    def _enum(self, enum, scope: str) -> None:
        name = f"{scope}.{enum.name}"
        prefix = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", enum.name).upper() + "_"
        self._expect(not enum.options.allow_alias, name, "has two names for one number")
        self._expect(enum.value[0].number == 0 and enum.value[0].name == prefix + "UNSPECIFIED", name,
                     f"does not begin with {prefix}UNSPECIFIED = 0")
        for value in enum.value:
            self.lines.append(f"value {name}.{value.name} = {value.number}")
            self._expect(value.name.startswith(prefix), f"{name}.{value.name}", f"does not begin with {prefix}")

    def _service(self, service, scope: str) -> None:
        name = f"{scope}.{service.name}"
        self._expect(service.name.endswith("Service"), name, "does not end with Service")
        for method in service.method:
            place = f"{name}.{method.name}"
            streams = [("stream " if streaming else "") + kind.lstrip(".")
                       for streaming, kind in ((method.client_streaming, method.input_type), (method.server_streaming, method.output_type))]
            self.lines.append(f"method {place} ({streams[0]}) returns ({streams[1]})")


def main() -> int:
    root = pathlib.Path(sys.argv[1])
    accepted_file = root / "proto" / "contract.txt"
    contract = Contract(read_contract(root))
    accepted = accepted_file.read_text().splitlines() if accepted_file.exists() else []
    gone = sorted(set(accepted) - set(contract.lines))
    new = sorted(set(contract.lines) - set(accepted))
    for line in gone:
        print(f"breaks older programs: {line}: is gone or is another one; keep it, and add beside it")
    for finding in contract.findings:
        print(f"rule: {finding}")
    if gone or contract.findings:
        return 1
    if sys.argv[2:] == ["--accept"]:
        accepted_file.write_text("\n".join(contract.lines) + "\n")
        return 0
    for line in new:
        print(f"not accepted yet: {line}")
    if new:
        print(f"what is new is kept for good: where you want that, run {sys.argv[0]} {sys.argv[1]} --accept")
    return 1 if new else 0


if __name__ == "__main__":
    sys.exit(main())
