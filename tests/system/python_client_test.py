"""What a MES programmer in Python sees of a refused call: code, reason, value, fields and what would be right, from a live
trajectory and from trailers that are not as they should be."""

import pathlib
import sys
import tempfile
import types
import unittest

import cell_under_test as under_test
import grpc
from eventually import eventually
from lambdajet.type.v1 import error_pb2
from lambdajet_client import Cell, trajectory_pb2, trouble_of
from lambdajet_plan_feed import COLUMNS, slow_rows
from lambdajet_trouble import DETAILS

BUILD = pathlib.Path(sys.argv.pop(1))
PROGRAM = (under_test.SOURCE / "tests" / "system" / "kill_plate.ngc").read_bytes()
DEADLINE_S = 10


class Refused(grpc.RpcError):
    """An error as gRPC raises it."""

    def __init__(self, code, words, trailer=()):
        super().__init__(words)
        self._said = code, words, trailer

    def code(self):
        return self._said[0]

    def details(self):
        return self._said[1]

    def trailing_metadata(self):
        return self._said[2]


class TroubleOf(unittest.TestCase):
    def test_a_refusal_without_a_trailer_has_the_reason_that_stands_before_its_words(self):
        trouble = trouble_of(Refused(grpc.StatusCode.PERMISSION_DENIED, "ROLE_NOT_ALLOWED: role none; a certificate of role a is right"))
        self.assertEqual((trouble.reason, trouble.message), ("ROLE_NOT_ALLOWED", "role none; a certificate of role a is right"))
        for words in ("failed to connect", "Socket closed: x", "", None):
            trouble = trouble_of(Refused(grpc.StatusCode.UNAVAILABLE, words, None))
            self.assertEqual((trouble.reason, trouble.message), ("UNAVAILABLE", words or ""))

    def test_a_trailer_of_another_program_takes_nothing_away(self):
        odd = error_pb2.Status(code=5, message="gone")
        odd.details.add(type_url="type.googleapis.com/google.rpc.Help", value=b"\xff\xff")
        odd.details.add(type_url="type.googleapis.com/google.rpc.ErrorInfo", value=b"\xff\xff\xff")
        for trailer in (b"", b"\xff\xff\xff\xff", odd.SerializeToString()):
            trouble = trouble_of(Refused(grpc.StatusCode.NOT_FOUND, "gone", ((DETAILS, trailer), ("x-other", "y"))))
            self.assertEqual((trouble.reason, trouble.message, trouble.violations), ("NOT_FOUND", "gone", ()))


class LiveTrajectory(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        domain = cls.enterClassContext(under_test.private_domain())
        folder = cls.enterClassContext(tempfile.TemporaryDirectory(prefix="lambdajet-python-"))
        options = types.SimpleNamespace(machine=under_test.SOURCE / "deploy" / "config" / "machine.yaml", plant=None, seed=1)
        cls.processes = under_test.cell_processes.LocalProcesses(
            under_test.SOURCE, BUILD, pathlib.Path(folder), options, flags=[f"--bus.domain={domain}", "--metrics.address=127.0.0.1:0"],
            ports=under_test.cell_processes.free_ports(domain))
        cls.addClassCleanup(cls.processes.stop)
        for name in ("calibration", "trajectory"):
            cls.processes.start_one(name)
        eventually(lambda: all(cls.processes.announced(name) for name in ("calibration", "trajectory")), 20,
                   lambda: cls.processes.last_words("trajectory"))
        cls.cell = Cell(cls.processes.addresses())
        cls.addClassCleanup(cls.cell.close)

        def planned():
            cls.plan = cls.ask("PlanProgram", trajectory_pb2.PlanProgramRequest(program=PROGRAM))
            return not hasattr(cls.plan, "reason")  # the machine description has come

        eventually(planned, 20, lambda: cls.plan)

    @classmethod
    def ask(cls, call, request):
        """The answer, or the trouble."""
        try:
            return getattr(cls.cell.trajectory, call)(request, timeout=DEADLINE_S)
        except grpc.RpcError as error:
            return trouble_of(error)

    def test_a_bad_request_names_each_field_with_its_value_and_what_would_be_right(self):
        wrong = trajectory_pb2.PlanProgramRequest(program=PROGRAM)
        wrong.options.feed_scale, wrong.options.overlap_mm = 9, -1
        trouble = self.ask("PlanProgram", wrong)
        self.assertEqual((trouble.code, trouble.reason), (grpc.StatusCode.INVALID_ARGUMENT, "OUT_OF_RANGE"))
        self.assertEqual([(one.field, one.reason) for one in trouble.violations],
                         [("options.feed_scale", "OUT_OF_RANGE"), ("options.overlap_mm", "OUT_OF_RANGE")])
        self.assertIn("9", trouble.violations[0].description)
        self.assertIn("1.2", trouble.violations[0].description)
        for word in ("OUT_OF_RANGE", "options.feed_scale", "options.overlap_mm"):
            self.assertIn(word, str(trouble))

    def test_a_refusal_has_the_numbers_that_belong_to_its_reason(self):
        wrong = trajectory_pb2.PlanProgramRequest(program=PROGRAM)
        wrong.options.machine_version = 17
        trouble = self.ask("PlanProgram", wrong)
        self.assertEqual((trouble.code, trouble.reason), (grpc.StatusCode.FAILED_PRECONDITION, "MACHINE_VERSION_NOT_HELD"))
        self.assertEqual(trouble.details, {"active_version": "0"})
        self.assertIn("version 17 is not held here; active is version 0", trouble.message)
        self.assertIn("active_version 0", str(trouble))

    def test_a_stream_is_refused_with_the_same_words(self):
        with self.assertRaises(grpc.RpcError) as refused:
            list(self.cell.trajectory.StreamSamples(trajectory_pb2.StreamSamplesRequest(plan_id=7), timeout=DEADLINE_S))
        self.assertEqual(trouble_of(refused.exception).reason, "UNKNOWN_PLAN")
        self.assertEqual(self.ask("GetPlan", trajectory_pb2.GetPlanRequest(plan_id=7)).reason, "UNKNOWN_PLAN")

    def test_where_the_feed_is_not_held_is_told_in_rows(self):
        told = list(self.cell.trajectory.WatchPlan(trajectory_pb2.WatchPlanRequest(plan_id=self.plan.plan_id), timeout=60))
        summary = told[-1].summary
        rows = slow_rows(summary)
        self.assertGreater(len(rows), 0)
        self.assertEqual(len(rows), min(200, summary.slow_stretch_count))
        for row in rows:
            at = dict(zip(COLUMNS, row, strict=True))
            self.assertLess(at["lowest mm/s"], at["programmed mm/s"])
            self.assertRegex(at["reaches"], r"^\d+\.\d % of [A-Z_0-9]+$")
            self.assertTrue(at["from s mm"] - 1e-6 <= at["at s mm"] <= at["to s mm"] + 1e-6, at)
            self.assertTrue(0 <= at["over %"] <= 100, at)


if __name__ == "__main__":
    unittest.main()
