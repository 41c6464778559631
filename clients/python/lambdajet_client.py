"""Talks to a Lambdajet cell over gRPC.

The stubs are generated at build time into build/<preset>/python; point LAMBDAJET_PYTHON_STUBS at that folder, or keep the
default layout. One Cell object holds one channel for each process.

    cell = Cell()                      # processes on this host, default ports
    try:
        job = cell.jobs.SubmitJob(...)
    except grpc.RpcError as error:
        print(trouble_of(error))       # reason, value, what would be right; see lambdajet_trouble.py
"""

import grpc
import lambdajet_stubs  # noqa: F401  # before the stubs

from lambdajet.accuracy.v1 import accuracy_pb2, accuracy_pb2_grpc
from lambdajet.calibration.v1 import calibration_pb2, calibration_pb2_grpc
from lambdajet.cell.v1 import cell_pb2, cell_pb2_grpc
from lambdajet.inspection.v1 import inspection_pb2, inspection_pb2_grpc
from lambdajet.trajectory.v1 import trajectory_pb2, trajectory_pb2_grpc
from lambdajet_trouble import Trouble, trouble_of  # noqa: F401  # for who imports this

# name: default gRPC port on this host
PORTS = {
    "kinematics": 50051,
    "calibration": 50052,
    "trajectory": 50053,
    "accuracy": 50054,
    "cell": 50055,
    "drive": 50056,
    "main_motion": 50057,
    "inspection": 50058,
}

_SERVING = b"\x08\x01"  # grpc.health.v1.HealthCheckResponse{status: SERVING}


class Cell:
    """Channels and stubs of one cell. addresses: process name -> host:port, for those not on their default port.
    credentials: grpc.ssl_channel_credentials(ca, key, certificate) where the cell speaks TLS; which calls the certificate allows
    is the services' rpc.roles."""

    def __init__(self, addresses=None, credentials=None):
        self.addresses = {name: f"127.0.0.1:{port}" for name, port in PORTS.items()}
        self.addresses.update(addresses or {})
        options = [("grpc.max_receive_message_length", 64 << 20), ("grpc.max_send_message_length", 64 << 20)]
        self.channels = {
            name: grpc.secure_channel(at, credentials, options) if credentials else grpc.insecure_channel(at, options)
            for name, at in self.addresses.items()
        }
        self.jobs = cell_pb2_grpc.CellServiceStub(self.channels["cell"])
        self.trajectory = trajectory_pb2_grpc.TrajectoryServiceStub(self.channels["trajectory"])
        self.calibration = calibration_pb2_grpc.CalibrationServiceStub(self.channels["calibration"])
        self.accuracy = accuracy_pb2_grpc.AccuracyServiceStub(self.channels["accuracy"])
        self.inspection = inspection_pb2_grpc.InspectionServiceStub(self.channels["inspection"])

    def serving(self, name, timeout_s=0.2):
        """Whether a process answers its health check with SERVING."""
        check = self.channels[name].unary_unary(
            "/grpc.health.v1.Health/Check", request_serializer=bytes, response_deserializer=bytes
        )
        try:
            return check(b"", timeout=timeout_s) == _SERVING
        except grpc.RpcError:
            return False

    def close(self):
        for channel in self.channels.values():
            channel.close()
