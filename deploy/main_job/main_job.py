#!/usr/bin/env python3
"""The main job on a simulated open-base machine: verify the base, cut the part as the crew left the modules, identify the
electronic base, cut again, cut again compensated, inspect each."""

import argparse
import pathlib
import shutil
import signal
import subprocess
import sys
import time
import uuid

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / "clients" / "python"))


def parse():
    parser = argparse.ArgumentParser(
        prog="deploy/demo",
        description="Installs, builds, starts seven processes and the judge, and runs the main job: verify the base, cut the "
        "part as set up, identify, cut identified, cut identified and compensated, inspect each. Takes about four minutes "
        "after the build (about 11 minutes on two cores). Writes build/demo/report.json and build/demo/report.html. Ctrl-C stops everything in order.",
    )
    parts = SOURCE / "deploy" / "parts"
    parser.add_argument("--plant", type=pathlib.Path, default=SOURCE / "deploy" / "plants" / "shipped.yaml",
                        help="the truth: the simulated machine's plant file (default: deploy/plants/shipped.yaml)")
    parser.add_argument("--part", type=pathlib.Path, default=parts / "bracket.ngc",
                        help="the part program; its drawing <part>.drawing.yaml lies beside it (default: deploy/parts/bracket.ngc)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the plant's noise and of the predictor's draws (default: 1)")
    parser.add_argument("--machine", type=pathlib.Path, default=SOURCE / "deploy" / "config" / "machine.yaml",
                        help="the machine as designed (default: deploy/config/machine.yaml)")
    parser.add_argument("--keep", action="store_true", help="leave the cell running for clients after the job; Ctrl-C ends it")
    parser.add_argument("--containers", action="store_true", help="every process in a container of its own (podman, root); the image compiles the sources itself, which takes as long "
                        "as the build and is kept for the next time")
    parser.add_argument("--out", type=pathlib.Path, default=SOURCE / "build" / "demo", help="folder of the report (default: build/demo)")
    parser.add_argument("--build-folder", type=pathlib.Path, default=SOURCE / "build" / "release", help=argparse.SUPPRESS)
    parser.add_argument("--domain", type=int, help=argparse.SUPPRESS)  # tests: a DDS domain of their own
    # tests: "host" takes the programs of the build folder into the image instead of compiling them in it
    parser.add_argument("--container-programs", choices=("build", "host"), default="build", help=argparse.SUPPRESS)
    parser.add_argument("--free-ports", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    for name in ("plant", "part", "machine", "out", "build_folder"):
        setattr(options, name, getattr(options, name).resolve())
    for name in ("plant", "part", "machine"):
        if not getattr(options, name).is_file():
            parser.error(f"--{name}: there is no file {getattr(options, name)}")
    options.drawing = options.part.with_suffix(".drawing.yaml")
    if not options.drawing.is_file():
        parser.error(f"--part: its drawing {options.drawing} is not there; inspection needs it")
    return options


class Console:
    """Progress bars on a terminal, plain lines elsewhere."""

    def __init__(self):
        self.live = sys.stdout.isatty()
        self.last_share = -1

    def say(self, words):
        self.end_bar()
        print(words, flush=True)

    def bar(self, share, words):
        share = min(1.0, max(0.0, share))
        if self.live:
            full = int(30 * share)
            print(f"\r\033[K  [{'#' * full}{'.' * (30 - full)}] {100 * share:3.0f} %  {words}", end="", flush=True)
            self.last_share = share
        elif int(share * 4) != int(max(0.0, self.last_share) * 4) or self.last_share < 0:
            print(f"  {100 * share:3.0f} %  {words}", flush=True)
            self.last_share = share

    def end_bar(self):
        if self.live and self.last_share >= 0:
            print()
        self.last_share = -1

    def job(self, job):
        if job.state_word == "HELD" or job.state_word == "INTERRUPTED":
            words = f"{job.state_word.lower()}: {job.reason}"
        else:
            words = f"{job.s_mm:.0f} of {job.length_mm:.0f} mm, {job.feed_mm_per_s:.0f} mm/s"
        self.bar(job.progress, words)


class TimerJitter:
    """cyclictest beside the cell: how late this machine's own timer wakes a real-time thread."""

    def __init__(self):
        self.child = None
        program = shutil.which("cyclictest")
        if program:
            self.child = subprocess.Popen(
                [program, "-q", "-p", "40", "-i", "1000", "-h", "20000", "-l", "1000000"],
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True, text=True)

    def stop(self):
        """Percentiles in µs, or {} where cyclictest is not to be had."""
        if self.child is None:
            return {}
        self.child.send_signal(signal.SIGINT)
        try:
            output, _ = self.child.communicate(timeout=5)
        except subprocess.TimeoutExpired:
            self.child.kill()
            self.child.communicate()
            return {}
        counts = []
        overflow = 0
        for line in output.splitlines():
            words = line.split()
            if len(words) == 2 and words[0].isdigit() and words[1].isdigit():
                counts.append((int(words[0]), int(words[1])))
            elif line.startswith("# Max Latencies:"):
                overflow = int(words[-1])
        return self.percentiles(counts, overflow)

    @staticmethod
    def percentiles(counts, worst):
        total = sum(count for _, count in counts)
        if total == 0:
            return {}
        found = {"max": worst}
        for name, share in (("p50", 0.5), ("p99", 0.99)):
            seen = 0
            for micros, count in counts:
                seen += count
                if seen >= share * total:
                    found[name] = micros
                    break
        return found


class Run:
    """What the main job has found so far."""

    def __init__(self, options):
        self.options = options
        self.part_name = options.part.stem
        self.plant_name = options.plant.stem
        self.seed = options.seed
        self.containers = options.containers
        self.stages = []
        self.model_versions = []
        self.verification = {}
        self.identification = {}
        self.ready_s = 0.0
        self.resident_idle = {}
        self.resident_after = {}
        self.timer_jitter_us = {}


def job_words(console):
    """A tell function for stages.run that turns wire jobs into what Console.job shows."""
    from lambdajet_client import cell_pb2

    class View:
        pass

    def tell(job):
        view = View()
        view.state_word = cell_pb2.JobState.Name(job.state).removeprefix("JOB_STATE_")
        for name in ("reason", "s_mm", "length_mm", "feed_mm_per_s", "progress"):
            setattr(view, name, getattr(job, name))
        console.job(view)

    return tell


def cut_stage(run, cell, console, name, compensate, wish):
    import report
    import stages

    console.say(f"\nCutting {run.part_name} {name}.")
    jitter = TimerJitter()
    try:
        result = stages.cut(cell, f"{run.part_name} {name}", run.program, run.drawing, compensate, f"{wish}-{name.replace(' ', '-')}",
                            run.seed, job_words(console))
    finally:
        measured = jitter.stop()
    run.timer_jitter_us = measured or run.timer_jitter_us
    stage = report.Stage(name, *result)
    run.stages.append(stage)
    f = stage.figures()
    console.say(f"  the judge: 95 % of the contour within {f['p95_mm']:.3f} mm, worst {f['max_mm']:.3f} mm; predicted bound {f['predicted_95_mm']:.3f} mm")


def verify_stage(run, cell, console, wish):
    import stages

    console.say("\nVerifying the base: the camera looks at a few marks on the sheet.")
    found = stages.verify(cell, f"{wish}-verify", job_words(console), console.say)
    run.verification = {
        "verdict": found.verdict, "chi_square": found.chi_square, "degrees_of_freedom": found.degrees_of_freedom,
        "shift_x_mm": found.shift_x_mm, "shift_y_mm": found.shift_y_mm, "turn_rad": found.turn_rad, "rms_mm": found.rms_mm,
        "message": found.message,
    }
    console.say(f"  {found.verdict}: {found.message}")


def identify_stage(run, cell, console, wish):
    import stages

    console.say("\nIdentifying the electronic base, the jet offset and the elasticity: marks, trial pierces, a shaken sheet.")
    tell = job_words(console)
    job, result, active = stages.identify(cell, f"{wish}-identify", tell, console.say, lambda op: console.bar(op.progress, op.phase))
    parameters = [{"name": p.name, "unit": p.unit, "before": p.before, "before_sigma": p.before_sigma, "after": p.after,
                   "after_sigma": p.after_sigma} for p in result.parameters]
    words = (f"{job.length_mm:.0f} mm of measuring; residuals {result.rms_before_mm:.3f} mm before, {result.rms_after_mm:.4f} mm after, "
             f"{result.rms_hold_out_mm:.4f} mm on looks kept out; stiffness {result.stiffness_n_per_mm:.1f} N/mm; the jet's place is now "
             f"known to {result.place_bound_95_mm:.3f} mm (95 %, worst place of the sheet)")
    run.identification = {"words": words, "parameters": parameters, "rms_before_mm": result.rms_before_mm,
                          "rms_after_mm": result.rms_after_mm, "rms_hold_out_mm": result.rms_hold_out_mm,
                          "stiffness_n_per_mm": result.stiffness_n_per_mm, "place_bound_95_mm": result.place_bound_95_mm,
                          "weak_directions": list(result.weak_directions), "outliers": list(result.outliers)}
    run.model_versions.append({"version": active.version, "hash": active.hash})
    console.say(f"  {words}\n  version {active.version} is active")


def main_job(run, processes, cell, console):
    import report
    import stages

    wish = uuid.uuid4().hex[:12]
    run.program = run.options.part.read_text()
    run.drawing = run.options.drawing.read_text()
    console.say("\nReferencing both modules.")
    state = stages.reference(cell)
    run.model_versions = [{"version": state.model_version.version, "hash": state.model_version.hash}]
    run.resident_idle = processes.resident_mib()
    verify_stage(run, cell, console, wish)
    cut_stage(run, cell, console, "as set up", False, wish)
    identify_stage(run, cell, console, wish)
    cut_stage(run, cell, console, "identified", False, wish)
    cut_stage(run, cell, console, "identified and compensated", True, wish)
    run.resident_after = processes.resident_mib()
    report.write(run, run.options.out)
    console.say("\n" + report.table(run))
    console.say(f"\nreport: {run.options.out / 'report.html'} and report.json beside it")


def make_processes(options):
    import cell_processes

    run_folder = options.out / "run"
    if run_folder.exists():
        shutil.rmtree(run_folder)
    if options.containers:
        import cell_containers

        return cell_containers.Containers(SOURCE, run_folder, options)
    flags = [f"--bus.domain={options.domain}"] if options.domain else []
    ports = cell_processes.free_ports(options.domain or 0) if options.free_ports else None
    if ports:
        flags.append("--metrics.address=127.0.0.1:0")
    return cell_processes.LocalProcesses(SOURCE, options.build_folder, run_folder, options, flags, ports)


def start(run, processes, console):
    import cell_processes
    import lambdajet_client

    console.say("Starting seven processes, and the judge.")
    began = processes.start()
    names = cell_processes.SEVEN + (cell_processes.JUDGE,)
    cell = cell_processes.wait_until_serving(processes, lambdajet_client.Cell, names, 60 if options_slow(run) else 20,
                                             lambda done, of: console.bar(done / of, f"{done} of {of} serve"))
    run.ready_s = time.monotonic() - began
    console.say(f"  all serve after {run.ready_s:.2f} s")
    return cell


def options_slow(run):
    return run.options.containers


def wait_for_ctrl_c(console, cell):
    console.say("The cell stays up for clients: " + ", ".join(f"{name} {at}" for name, at in sorted(cell.addresses.items())))
    console.say("Ctrl-C stops it.")
    signal.pause()


def stopped_by_signal(number, _frame):
    raise KeyboardInterrupt


def main():
    options = parse()
    for number in (signal.SIGINT, signal.SIGTERM):  # also where a shell has started this with SIGINT ignored
        signal.signal(number, stopped_by_signal)
    console = Console()
    run = Run(options)
    processes = make_processes(options)
    cell = None
    try:
        cell = start(run, processes, console)
        main_job(run, processes, cell, console)
        if options.keep:
            wait_for_ctrl_c(console, cell)
        return 0
    except KeyboardInterrupt:
        console.say("\nstopping, in order")
        return 0 if run.resident_after else 130
    except Exception as error:  # the console is for people: one line, and where to look
        import stages

        console.say(f"\nthe main job ended: {stages.explain(error)}\nlogs: {options.out / 'run'}")
        return 1
    finally:
        if cell is not None:
            cell.close()  # so that no process has to wait for its client
        processes.stop()


if __name__ == "__main__":
    sys.exit(main())
