"""Names: files in snake_case, no banned words, a unit at the end of every dimensioned number that others see."""
import re

from source_tree import files, line_of, read, run, without_comments

BANNED = {"common", "util", "utils", "helper", "helpers", "manager", "misc", "data", "info", "handle", "do", "impl2"}
BANNED_TYPE_ENDS = ("Util", "Utils", "Helper", "Helpers", "Manager", "Misc", "Impl2")
BANNED_TYPES = {"Common", "Data", "Info", "Handle", "Do", "Process"}
SNAKE = re.compile(r"^[a-z0-9]+(_[a-z0-9]+)*$")
# Spelt as their tools want them.
FREE_FILES = {"CMakeLists.txt", "README.md", "DECISIONS.md", "CHANGELOG.md", "SECURITY.md"}

UNITS = {
    "mm", "mm2", "mm3", "um", "ppm", "m", "meters", "s", "s2", "ms", "us", "ns", "seconds", "rad", "deg", "n", "nm", "kg", "mpa", "g", "hz",
    "j", "w", "l", "percent", "ratio", "relative", "mib", "kib", "bytes", "min", "n_per_mm",
}
# Numbers that have no unit, or whose unit is another field's: the word that ends or makes the name, and why.
PURE = {
    "ratio": "a ratio", "relative": "a ratio", "rate": "tau_rate: seconds of program a second", "override": "a ratio of feed",
    "probability": "0 to 1", "confidence": "0 to 1", "progress": "0 to 1", "share": "0 to 1", "fraction": "0 to 1",
    "factor": "a factor", "scale": "a factor", "gain": "a factor", "weight": "a weight", "weights": "weights",
    "condition": "a condition number", "conditioning": "a condition number", "determinant": "of a scaled Jacobian",
    "squared": "a sum of squared normalised residuals", "square": "a chi-square",
    "value": "its unit is that of the key beside it", "values": "their unit is that of the key beside them",
    "argument": "its unit depends on the kind beside it", "sigma": "in the unit of the value beside it",
    "sigmas": "in standard deviations", "least": "in the unit of the value beside it", "most": "as least",
    "coefficients": "of a polynomial; units by degree", "parameters": "the parameter vector: a unit by entry",
    "covariance": "of the parameter vector", "correlation": "-1 to 1", "jacobian": "units by row and column",
    "quantile": "of a normalised figure", "statistic": "of a test", "residual": "in standard deviations",
    "residuals": "in standard deviations", "count": "a count", "threshold": "in the unit of what it bounds",
    "p": "a probability", "sin": "a sine", "cos": "a cosine", "seed": "a seed", "availability": "a ratio",
    "conformity": "a probability", "conforming": "a share", "inflation": "a factor", "parity": "+1 or -1",
    "learning": "a share", "overshoot": "a ratio", "sensitivity": "mm by the parameter's unit", "alarm": "a probability",
    "information": "an eigenvalue of a scaled matrix", "element": "of a matrix: units by row and column",
    "quality": "a ratio", "performance": "a ratio", "oee": "a ratio", "damping": "a damping ratio", "exponent": "a power",
    "before": "in the unit of the key beside it", "after": "as before", "level": "0 to 1", "singular": "of a scaled matrix",
}
# "path: field" ("path: *" for the whole file) that the rule would refuse, and why it is right.
K = "services/kinematics/core/"
EXCEPTIONS = {
    "services/trajectory/core/idle_motion/idle_law.hpp: *": "the normalised law: stroke, time and derivatives from 0 to 1",
    "services/trajectory/core/grinding/pilger_program.hpp: acceleration_jump": "a coordinate's unit by rad^2",
    "services/trajectory/core/grinding/wheel_path.hpp: first": "a coordinate's unit by rad",
    "services/trajectory/core/grinding/wheel_path.hpp: second": "a coordinate's unit by rad^2",
    "services/trajectory/core/part_program/cldata_verification.hpp: size": "in the unit of what breaks",
    "services/trajectory/core/part_program/cldata_verification.hpp: peak_first": "a coordinate's unit by the argument's",
    "services/trajectory/core/part_program/cldata_verification.hpp: peak_second": "as peak_first, squared",
    "services/trajectory/core/feed/speed_profile.hpp: x": "the unknown of the equations it quotes, speed squared",
    "services/trajectory/core/feed/speed_profile.hpp: curvature": "1/mm, as in the equations it quotes",
    "services/foundation/geometry/homogeneous_chain.hpp: acceleration": "rad or mm, as its elementary matrix turns or shifts",
    "services/foundation/machine/hexapod_geometry.hpp: singular_margin": "mm/mm",
    K + "hexapod_singularity.hpp: signed_margin": "mm/mm",
    K + "hexapod.hpp: excess": "in the unit of the bound that the reason names",
    K + "hexapod_kernel.hpp: determinant_start": "of a matrix whose units are scaled away",
    K + "hexapod_kernel.hpp: determinant_end": "as determinant_start",
    K + "service_area.hpp: c2": "a slope, mm/mm, as in the paper",
    K + "service_area.hpp: k": "a slope, mm/mm, as in the paper",
    K + "service_area.hpp: from": "in the unit of the parameter named beside it",
    K + "service_area.hpp: to": "in the unit of the parameter named beside it",
    "proto/lambdajet/kinematics/v1/kinematics.proto: x": "of a vector whose unit the holding field's name says",
    "proto/lambdajet/kinematics/v1/kinematics.proto: y": "as x",
    "proto/lambdajet/kinematics/v1/kinematics.proto: z": "as x",
    "proto/lambdajet/kinematics/v1/kinematics.proto: singular_margin": "mm/mm",
    "proto/lambdajet/kinematics/v1/kinematics.proto: signed_margin": "mm/mm",
    "proto/lambdajet/kinematics/v1/kinematics.proto: excess": "in the unit of the limit that the message names",
    "proto/lambdajet/kinematics/v1/kinematics.proto: sweep_from": "in the unit of the parameter named beside it",
    "proto/lambdajet/kinematics/v1/kinematics.proto: sweep_to": "as sweep_from",
}


def excepted(path, name):
    return f"{path}: {name}" in EXCEPTIONS or f"{path}: *" in EXCEPTIONS


FIELD = re.compile(r"^[ \t]*(?:std::optional<)?(?:double|float)>?[ \t]+([^;(){}]+?)[ \t]*;", re.M)
# A packed batch (repeated double) states stride and units in its comment, so its name is free.
PROTO_FIELD = re.compile(r"^[ \t]*(?:optional)?[ \t]*(?:double|float)[ \t]+(\w+)[ \t]*=[ \t]*\d+", re.M)
IDL_FIELD = re.compile(r"^[ \t]*(?:double|float)[ \t]+(\w+)(?:\[[^\]]*\])?[ \t]*;", re.M)
TYPE = re.compile(r"^\s*(?:class|struct|enum class|enum struct)\s+(?:\[\[\w+\]\]\s+)?(\w+)\b(?!\s*;)", re.M)


def has_unit(name):
    words = name.lower().strip("_").split("_")
    if words[-1] in UNITS or "per" in words or words[-1] in PURE:
        return True
    return len(words) == 1 and words[0] in PURE


def check_file_names(root):
    for top in ("services", "idl", "proto", "tests", "clients/cli"):
        for path in files(root, top, (".hpp", ".cpp", ".idl", ".proto", ".py", ".cmake")):
            parts = path.split("/")
            stem = parts[-1].split(".")[0]
            for word in [*parts[:-1], stem]:
                if parts[-1] not in FREE_FILES and not SNAKE.match(word):
                    yield f"{path}:1: '{word}' is not snake_case"
                if word in BANNED:
                    yield f"{path}:1: '{word}' says nothing; say what it is"


def check_types(root):
    for path in files(root, "services", (".hpp", ".cpp")):
        text = without_comments(read(root, path))
        for match in TYPE.finditer(text):
            name = match.group(1)
            if name in BANNED_TYPES or name.endswith(BANNED_TYPE_ENDS):
                yield f"{path}:{line_of(text, match.start(1))}: type '{name}' says nothing; say what it is"


def struct_bodies(text):
    """Bodies of structs in a header, members of member functions left out, as (offset, body)."""
    for match in re.finditer(r"\bstruct\s+\w+[^;{()]*\{", text):
        depth, at = 1, match.end()
        kept = []
        while depth > 0 and at < len(text):
            depth += {"{": 1, "}": -1}.get(text[at], 0)
            kept.append(text[at] if depth == 1 or text[at] in "{}\n" else " ")
            at += 1
        yield match.end(), "".join(kept)


def check_fields(root):
    for path in files(root, "services", (".hpp",)):
        text = without_comments(read(root, path))
        for offset, body in struct_bodies(text):
            for match in FIELD.finditer(body):
                for declared in match.group(1).split(","):
                    name = re.split(r"[={\[\s]", declared.strip())[0]
                    if name and not has_unit(name) and not excepted(path, name):
                        line = line_of(text, offset + match.start(1))
                        yield f"{path}:{line}: '{name}' has no unit at its end (mm, rad, s, …), nor is it a known pure number"
    for top, ending, pattern in (("proto", ".proto", PROTO_FIELD), ("idl", ".idl", IDL_FIELD)):
        for path in files(root, top, (ending,)):
            text = without_comments(read(root, path))
            for match in pattern.finditer(text):
                name = match.group(1)
                if not has_unit(name) and not excepted(path, name):
                    yield f"{path}:{line_of(text, match.start(1))}: '{name}' has no unit at its end, nor is it a known pure number"


def check(root):
    yield from check_file_names(root)
    yield from check_types(root)
    yield from check_fields(root)


if __name__ == "__main__":
    run("names", check)
