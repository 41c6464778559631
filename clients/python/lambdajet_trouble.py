"""What a refused call has to say, for programs: the code, the reason, the numbers that belong to it, and which fields are wrong.

    try:
        cell.jobs.StartJob(request, timeout=5)
    except grpc.RpcError as error:
        trouble = trouble_of(error)
        if trouble.reason == "PERMIT_MISSING": ...
        print(trouble)                    # reason, what was wrong with its value, what would be right

A service sends google.rpc.Status with ErrorInfo and BadRequest in the trailer grpc-status-details-bin. A call that never reached
its handler (a role, a deadline, nobody there) has no such trailer: its reason stands before the words, or is the code's name.
"""

import dataclasses
import re

import grpc
import lambdajet_stubs  # noqa: F401  # before the stubs
from google.protobuf.message import DecodeError
from lambdajet.type.v1 import error_pb2

DETAILS = "grpc-status-details-bin"
_ERROR_INFO, _BAD_REQUEST = (f"type.googleapis.com/google.rpc.{name}" for name in ("ErrorInfo", "BadRequest"))
_REASON_FIRST = re.compile(r"([A-Z][A-Z0-9]*(?:_[A-Z0-9]+)+): (.*)", re.DOTALL)


@dataclasses.dataclass(frozen=True)
class Violation:
    """One field of the request that is not as it must be."""

    field: str  # dotted path, as "options.tolerances[3].tolerance_mm"
    reason: str  # UPPER_SNAKE
    description: str  # the value with its unit, and what would be right


@dataclasses.dataclass(frozen=True)
class Trouble:
    code: grpc.StatusCode
    reason: str  # UPPER_SNAKE, never empty
    message: str  # for people: what was wrong, the value with its unit, what would be right
    details: dict = dataclasses.field(default_factory=dict)  # numbers and names that belong to the reason
    violations: tuple = ()

    def __str__(self):
        numbers = [f"{key} {value}" for key, value in sorted(self.details.items())]
        fields = [f"{one.field}: {one.reason}: {one.description}" for one in self.violations]
        return "\n  ".join([f"{self.reason}: {self.message}", *numbers, *fields])


def trouble_of(error):
    """The trouble of a grpc.RpcError; never raises, whatever the trailer holds."""
    info, bad_request = error_pb2.ErrorInfo(), error_pb2.BadRequest()
    for key, value in error.trailing_metadata() or ():
        if key == DETAILS:
            _read(value, error_pb2.Status(), info, bad_request)
    message, reason = error.details() or "", info.reason
    before = None if reason else _REASON_FIRST.fullmatch(message)
    if before:
        reason, message = before.groups()
    return Trouble(
        code=error.code(),
        reason=reason or error.code().name,
        message=message,
        details=dict(info.metadata),
        violations=tuple(Violation(one.field, one.reason, one.description) for one in bad_request.field_violations),
    )


def _read(trailer, status, info, bad_request):
    try:
        status.ParseFromString(trailer)
        for detail in status.details:
            into = {_ERROR_INFO: info, _BAD_REQUEST: bad_request}.get(detail.type_url)
            if into is not None:
                into.ParseFromString(detail.value)
    except DecodeError:
        pass  # another program's trailer: what the status itself says remains
