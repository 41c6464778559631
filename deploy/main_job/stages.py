"""The stages of the main job, each a few calls to the services: reference, verify, cut, identify."""

import time

import grpc
from lambdajet_client import accuracy_pb2, calibration_pb2, cell_pb2, inspection_pb2, trajectory_pb2, trouble_of
from lambdajet.type.v1 import operation_pb2

RPC_TIMEOUT_S = 20.0
RESUMES_ALLOWED = 3
RUNS_ALLOWED = 3
ENDED = (cell_pb2.JOB_STATE_COMPLETED, cell_pb2.JOB_STATE_FAILED, cell_pb2.JOB_STATE_CANCELLED, cell_pb2.JOB_STATE_REFUSED)


class StageFailed(Exception):
    """The main job cannot go on; the text says why and what to do."""


def wait_until_heard(cell):
    """Whoever serves may still be unknown to the cell; waits until it has heard everyone."""
    deadline = time.monotonic() + 10
    lost = ["everyone"]
    while lost and time.monotonic() < deadline:
        state = cell.jobs.GetMachineState(cell_pb2.GetMachineStateRequest(), timeout=RPC_TIMEOUT_S).state
        lost = [f"{node.name} ({node.reason})" for node in state.nodes if node.mode == "LOST"]
        time.sleep(0.05)
    if lost:
        raise StageFailed(f"the cell has not heard {', '.join(lost)} for 10 s")


def reference(cell):
    """Resets what is latched and references both modules."""
    wait_until_heard(cell)
    answer = cell.jobs.ResetMachine(cell_pb2.ResetMachineRequest(), timeout=30)
    deadline = time.monotonic() + 10
    state = answer.state
    while state.vetoes and time.monotonic() < deadline:
        state = cell.jobs.GetMachineState(cell_pb2.GetMachineStateRequest(), timeout=RPC_TIMEOUT_S).state
        time.sleep(0.1)
    if state.vetoes:
        raise StageFailed("the machine may not start: " + "; ".join(state.vetoes))
    return state


def submit(cell, name, program, compensate, request_id):
    """Stores the job and waits until it is planned."""
    job = cell.jobs.SubmitJob(
        cell_pb2.SubmitJobRequest(request_id=request_id, name=name, program=program.encode(), compensate=compensate),
        timeout=RPC_TIMEOUT_S,
    ).job
    deadline = time.monotonic() + 120
    while job.state == cell_pb2.JOB_STATE_ADMITTING and time.monotonic() < deadline:
        time.sleep(0.1)
        job = cell.jobs.GetJob(cell_pb2.GetJobRequest(job_id=job.job_id), timeout=RPC_TIMEOUT_S).job
    if job.state != cell_pb2.JOB_STATE_READY:
        faults = "".join(f"\n  line {f.line}, column {f.column}: {f.reason}: {f.message}" for f in job.faults)
        raise StageFailed(f"the program of '{name}' was not admitted: {job.reason} {job.message}{faults}")
    return job


def run(cell, job, tell, on_resume=None):
    """Starts the job and follows it to its end, resuming after interruptions a few times."""
    cell.jobs.StartJob(cell_pb2.StartJobRequest(job_id=job.job_id), timeout=RPC_TIMEOUT_S)
    resumes = 0
    quiet_until = time.monotonic() + 60
    while True:
        job = cell.jobs.GetJob(cell_pb2.GetJobRequest(job_id=job.job_id), timeout=RPC_TIMEOUT_S).job
        tell(job)
        if job.state in ENDED:
            break
        if job.state == cell_pb2.JOB_STATE_INTERRUPTED:
            if resumes >= RESUMES_ALLOWED:
                raise StageFailed(f"interrupted {resumes + 1} times, last by {job.reason}: {job.message}")
            resumes += 1
            job = cell.jobs.ResumeJob(cell_pb2.ResumeJobRequest(job_id=job.job_id), timeout=60).job
            if on_resume:
                on_resume(job)
        if job.state in (cell_pb2.JOB_STATE_RUNNING, cell_pb2.JOB_STATE_STARTING):
            quiet_until = time.monotonic() + 60
        elif time.monotonic() > quiet_until:
            raise StageFailed(f"nothing has moved for a minute: {job.reason} {job.message}")
        time.sleep(0.2)
    if job.state != cell_pb2.JOB_STATE_COMPLETED:
        raise StageFailed(f"the job ended as {cell_pb2.JobState.Name(job.state)}: {job.reason} {job.message}")
    return job


def plan_samples(cell, plan_id):
    """The plan's points: flat list of stride 8 for accuracy, cutting flags, source lines."""
    values, cutting, lines = [], [], []
    request = trajectory_pb2.StreamSamplesRequest(plan_id=plan_id, step_s=0.01)
    for batch in cell.trajectory.StreamSamples(request, timeout=60):
        stride = len(batch.values) // max(1, len(batch.cutting))
        for at in range(len(batch.cutting)):
            values.extend(batch.values[at * stride : at * stride + 8])
        cutting.extend(batch.cutting)
        lines.extend(batch.source_line)
    return values, cutting, lines


def predict(cell, plan_id, compensated, seed):
    values, cutting, lines = plan_samples(cell, plan_id)
    return cell.accuracy.PredictContour(
        accuracy_pb2.PredictContourRequest(
            values=values, cutting=cutting, source_line=lines, compensated=compensated, seed=seed
        ),
        timeout=120,
    )


def cut(cell, name, program, drawing, compensate, request_id, seed, tell):
    """Plans, predicts, cuts and inspects; returns (job, prediction, inspection, report)."""
    job = submit(cell, name, program, compensate, request_id)
    first_plan = job.plan_id
    prediction = predict(cell, first_plan, compensate, seed)
    cell.inspection.BeginRecording(inspection_pb2.BeginRecordingRequest(plan_id=first_plan), timeout=RPC_TIMEOUT_S)

    def also_record(resumed):
        further = [plan for plan in resumed.plan_ids if plan != first_plan]
        cell.inspection.BeginRecording(
            inspection_pb2.BeginRecordingRequest(plan_id=first_plan, further_plan_ids=further), timeout=RPC_TIMEOUT_S
        )

    job = run(cell, job, tell, also_record)
    cell.inspection.EndRecording(inspection_pb2.EndRecordingRequest(plan_id=first_plan), timeout=RPC_TIMEOUT_S)
    found = cell.inspection.Inspect(
        inspection_pb2.InspectRequest(plan_id=first_plan, drawing_yaml=drawing), timeout=120
    )
    report = cell.jobs.GetReport(cell_pb2.GetReportRequest(job_id=job.job_id), timeout=RPC_TIMEOUT_S)
    return job, prediction, found, report


def run_in_one_piece(cell, name, program, request_id, tell, say):
    """Calibration judges the looks of one plan. A run that was interrupted and resumed left its looks in two, so it is driven again."""
    for attempt in range(RUNS_ALLOWED):
        job = run(cell, submit(cell, name, program, False, f"{request_id}-{attempt}"), tell)
        if len(job.plan_ids) <= 1:
            return job
        say("  it was interrupted on the way and resumed; the looks of one uninterrupted run are needed, so once more")
    raise StageFailed(f"'{name}' was interrupted in each of {RUNS_ALLOWED} runs; the machine's own words are in the modules' logs")


def verify(cell, request_id, tell, say):
    """Looks at a few marks and compares them with the active version."""
    plan = cell.calibration.PlanVerification(calibration_pb2.PlanVerificationRequest(), timeout=RPC_TIMEOUT_S)
    job = run_in_one_piece(cell, "verify the base", plan.program, request_id, tell, say)
    return cell.calibration.VerifyBase(calibration_pb2.VerifyBaseRequest(plan_id=job.plan_id), timeout=RPC_TIMEOUT_S)


def identify(cell, request_id, tell, say, tell_operation):
    """Measures, identifies and activates; returns (plan of the run, result, active version)."""
    plan = cell.calibration.PlanMeasuringRun(calibration_pb2.PlanMeasuringRunRequest(), timeout=RPC_TIMEOUT_S)
    job = run_in_one_piece(cell, "measuring run", plan.program, request_id, tell, say)
    operation = cell.calibration.StartIdentification(
        calibration_pb2.StartIdentificationRequest(plan_id=job.plan_id, author="main-job"), timeout=RPC_TIMEOUT_S
    ).operation
    while operation.state == operation_pb2.OPERATION_STATE_RUNNING:
        time.sleep(0.1)
        answer = cell.calibration.GetIdentification(
            calibration_pb2.GetIdentificationRequest(operation_id=operation.id), timeout=RPC_TIMEOUT_S
        )
        operation = answer.operation
        tell_operation(operation)
    if operation.state != operation_pb2.OPERATION_STATE_DONE:
        raise StageFailed(f"identification ended with {operation.reason}: {operation.message}")
    answer = cell.calibration.GetIdentification(
        calibration_pb2.GetIdentificationRequest(operation_id=operation.id), timeout=RPC_TIMEOUT_S
    )
    active = cell.calibration.ActivateVersion(
        calibration_pb2.ActivateVersionRequest(version=answer.result.version, author="main-job"), timeout=RPC_TIMEOUT_S
    ).model_version
    wait_for_version(cell, active.version)
    return job, answer.result, active


def wait_for_version(cell, version):
    """Activation travels over the bus; waits until the cell sees it."""
    deadline = time.monotonic() + 10
    while time.monotonic() < deadline:
        state = cell.jobs.GetMachineState(cell_pb2.GetMachineStateRequest(), timeout=RPC_TIMEOUT_S).state
        if state.model_version.version == version:
            return
        time.sleep(0.05)
    raise StageFailed(f"version {version} was activated but has not reached the cell after 10 s")


def explain(error):
    """A gRPC error in one line, with its reason."""
    if isinstance(error, grpc.RpcError):
        return f"{error.code().name}: {trouble_of(error)}"
    return str(error)
