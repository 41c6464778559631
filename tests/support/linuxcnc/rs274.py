"""rs274.py: LinuxCNC's interpreter from Debian's package, unpacked and not installed, and what it makes of a program.

Motions are tuples of one form for both readers: a kind (TRAVERSE, LINE, ARC, DWELL), its end X Y Z A B C in mm and degrees in
machine coordinates, feed in mm/s, and of an arc centre, plane and turns (whole circles begun, counter-clockwise positive)."""
import math
import os
import re
import subprocess
import tempfile
from pathlib import Path

PACKAGES = ("linuxcnc-uspace", "libboost-python1.74.0")
TRIES = 8  # rs274 now and then dies while it ends
AXES = 6
INCH_MM = 25.4
ARC_AXES = {"XY": (0, 1, 2), "XZ": (2, 0, 1), "YZ": (1, 2, 0)}


class Refused(Exception):
    pass


def unpack(folder):
    """Fetches the packages into `folder` unless they are there; answers the interpreter's version."""
    folder.mkdir(parents=True, exist_ok=True)
    if not (folder / "usr/bin/rs274").exists():
        for package in PACKAGES:
            # As a user of its own, apt may not write into this folder.
            subprocess.run(["apt-get", "-o", "APT::Sandbox::User=root", "download", package], cwd=folder, check=True,
                           stdout=subprocess.DEVNULL)
        for package in folder.glob("*.deb"):
            subprocess.run(["dpkg-deb", "--extract", package, folder], check=True)
    return next(folder.glob("linuxcnc-uspace_*.deb")).name.split("_")[1].replace("%3a", ":").replace("%7e", "~")


class Interpreter:
    """rs274 with an empty parameter file and one tool of no length and no diameter."""

    def __init__(self, folder):
        self.folder = folder
        self.environment = {**os.environ, "PYTHONPATH": str(folder / "usr/lib/python3/dist-packages"),
                            "LD_LIBRARY_PATH": f"{folder}/usr/lib:{folder}/usr/lib/x86_64-linux-gnu"}

    def motions(self, program):
        """What the program means; raises Refused with the interpreter's words."""
        with tempfile.TemporaryDirectory() as place:
            here = Path(place)
            (here / "program.ngc").write_text(program, encoding="utf-8", errors="surrogateescape")
            (here / "tools").write_text("T1 P1 Z0 D0 ;\n")
            for _ in range(TRIES):
                (here / "parameters").write_text("")
                # -b: blocks with a slash are left out, as the machine's own switch stands at first.
                run = subprocess.run([self.folder / "usr/bin/rs274", "-g", "-b", "-t", "tools", "-v", "parameters", "program.ngc"],
                                     cwd=here, env=self.environment, text=True, errors="replace", capture_output=True, timeout=120,
                                     check=False)
                if run.returncode >= 0:
                    break
            else:
                raise RuntimeError(f"rs274 died {TRIES} times")
        said = [line for line in run.stderr.splitlines() if line.strip() and line != "executing" and "variable file" not in line]
        if said:
            raise Refused(" | ".join(said))
        return list(motions_of(run.stdout))


def numbers(text):
    return [float(n) for n in re.findall(r"-?\d+\.?\d*", text)]


def motions_of(output):
    """Of rs274's canonical calls: program coordinates, in the program's units, become machine coordinates."""
    state = {"unit": 1.0, "work": [0.0] * AXES, "shift": [0.0] * AXES, "tool": [0.0] * AXES, "plane": "XY", "feed": 0.0}
    for line in output.splitlines():
        call = re.match(r"\s*\d+ N\S*\s+(\w+)\((.*)\)\s*$", line)
        if not call or call[1] in ("COMMENT", "MESSAGE"):
            continue
        name, written = call[1], call[2]
        values = numbers(written)
        if name == "USE_LENGTH_UNITS":
            state["unit"] = INCH_MM if "INCH" in written else 1.0
        elif name == "SET_G5X_OFFSET":
            state["work"] = in_mm(values[1:7], state["unit"])
        elif name == "SET_G92_OFFSET":
            state["shift"] = in_mm(values[:6], state["unit"])
        elif name == "USE_TOOL_LENGTH_OFFSET":
            state["tool"] = in_mm(values[:6], state["unit"])
        elif name == "SET_XY_ROTATION" and values[0] != 0.0:
            raise Refused("a turned work offset")
        elif name == "SELECT_PLANE":
            state["plane"] = written[-2:]
        elif name == "SET_FEED_RATE":
            state["feed"] = values[0] * state["unit"] / 60.0
        elif name == "STRAIGHT_TRAVERSE":
            yield ("TRAVERSE", absolute(values, state))
        elif name == "STRAIGHT_FEED":
            yield ("LINE", absolute(values, state), state["feed"])
        elif name == "ARC_FEED":
            yield arc(values, state)
        elif name == "DWELL":
            yield ("DWELL", values[0])


def in_mm(values, unit):
    return [v * unit for v in values[:3]] + values[3:6] + [0.0] * (AXES - len(values))


def absolute(values, state):
    return [v + state["work"][i] + state["shift"][i] + state["tool"][i] for i, v in enumerate(in_mm(values, state["unit"]))]


def arc(values, state):
    first, second, along = ARC_AXES[state["plane"]]
    end, centre = [0.0] * AXES, [0.0] * AXES
    end[first], end[second], end[along] = values[0], values[1], values[5]
    end[3:] = values[6:9]
    centre[first], centre[second], centre[along] = values[2], values[3], values[5]
    return ("ARC", absolute(end, state), state["feed"], absolute(centre, state)[:3], state["plane"], int(values[4]))


# ---- what `lambdajet trajectory canon` prints ----

def motions_of_canon(output):
    for line in output.splitlines():
        _, name, *words = line.split()
        value = {key: float(number) for key, _, number in (word.partition("=") for word in words) if re.match(r"-?[\d.]", number)}
        end = [value.get(f"{axis}_mm", 0.0) for axis in "xyz"] + [math.degrees(value.get(f"{axis}_rad", 0.0)) for axis in "abc"]
        if name == "TRAVERSE":
            yield ("TRAVERSE", end)
        elif name == "FEED_LINE":
            yield ("LINE", end, value.get("feed_mm_per_s"))
        elif name == "FEED_ARC":
            yield canon_arc(value, end)
        elif name == "DWELL":
            yield ("DWELL", value["time_s"])


def canon_arc(value, end):
    plane = "YZ" if "center_x_mm" not in value else "XZ" if "center_y_mm" not in value else "XY"
    sweep = value["sweep_rad"]
    turns = math.copysign(math.ceil(abs(sweep) / (2 * math.pi) - 1e-4), sweep)
    return ("ARC", end, value.get("feed_mm_per_s"), [value.get(f"center_{axis}_mm", 0.0) for axis in "xyz"], plane, int(turns))


# ---- comparing ----

def difference(theirs, ours, tolerance_mm):
    """Why two motions are not the same; empty if they are."""
    if theirs[0] != ours[0]:
        return f"{theirs[0]} against {ours[0]}"
    if theirs[0] == "DWELL":
        return "" if abs(theirs[1] - ours[1]) < 1e-3 else f"{theirs[1]} s against {ours[1]} s"
    if any(abs(a - b) > tolerance_mm for a, b in zip(theirs[1], ours[1])):
        return f"to {theirs[1]} against {ours[1]}"
    if theirs[0] != "TRAVERSE" and ours[2] is not None and abs(theirs[2] - ours[2]) > 1e-4 * ours[2] + 50 * tolerance_mm:
        return f"{theirs[2]} mm/s against {ours[2]} mm/s"
    return arc_difference(theirs, ours, tolerance_mm) if theirs[0] == "ARC" else ""


def arc_difference(theirs, ours, tolerance_mm):
    if theirs[4:] != ours[4:]:
        return f"plane and turns {theirs[4:]} against {ours[4:]}"
    first, second, _ = ARC_AXES[theirs[4]]
    radius = math.hypot(theirs[1][first] - theirs[3][first], theirs[1][second] - theirs[3][second])
    # Where the written centre lies a little nearer to one end, ours is moved to lie between both.
    allowed = 2 * tolerance_mm + 3e-3 * radius
    if any(abs(theirs[3][i] - ours[3][i]) > allowed for i in (first, second)):
        return f"about {theirs[3]} against {ours[3]}"
    return ""


def moving(motions, tolerance_mm):
    """Without moves that go nowhere."""
    at, kept = [0.0] * AXES, []
    for motion in motions:
        if motion[0] in ("TRAVERSE", "LINE") and all(abs(a - b) < 0.51 * tolerance_mm for a, b in zip(motion[1], at)):
            continue
        at = motion[1] if motion[0] != "DWELL" else at
        kept.append(motion)
    return kept
