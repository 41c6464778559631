"""Header comments: every header opens with what it does, in the third person; every wire field says what it is."""
import re

from source_tree import files, read, run

# First words that are no verb, and are right.
NOT_A_VERB = {"What", "The", "Who", "Private", "How"}
PROTO_MEMBER = re.compile(r"^\s*(?:(?:optional|repeated)\s+)?(?:map<[^>]+>|[\w.]+)\s+\w+\s*=\s*\d+\s*(?:\[[^\]]*\])?\s*;(.*)$")


def check_header(path, text):
    lines = text.split("\n")
    if not lines[0].startswith("// "):
        yield f"{path}:1: has no header comment; the first line says in the third person what it does"
        return
    first = lines[0][3:].split(" ")[0].strip(",.:")
    if not first[:1].isupper() or not (first.endswith("s") or first in NOT_A_VERB):
        yield f"{path}:1: begins with '{first}'; right is a verb in the third person ('Solves …', 'Says …')"
    comment = []
    for line in lines:
        if not line.startswith("//"):
            break
        comment.append(line)
    if "." not in " ".join(comment):
        yield f"{path}:1: the header comment is no sentence"
    if "#pragma once" not in text:
        yield f"{path}:1: has no #pragma once"


def check_proto(path, text):
    """A comment on every field: on the line above, or at its end."""
    previous_comment = False
    for number, line in enumerate(text.split("\n"), 1):
        stripped = line.strip()
        match = PROTO_MEMBER.match(line)
        if match and not stripped.startswith(("option", "syntax", "package", "import", "//", "reserved")):
            if not previous_comment and "//" not in match.group(1):
                yield f"{path}:{number}: the field has no comment (unit, frame, range, default)"
        previous_comment = stripped.startswith("//") or (previous_comment and stripped == "")


def check(root):
    for path in files(root, "services", (".hpp",)):
        yield from check_header(path, read(root, path))
    for path in files(root, "clients", (".hpp",)):
        yield from check_header(path, read(root, path))
    for path in files(root, "proto", (".proto",)):
        yield from check_proto(path, read(root, path))


if __name__ == "__main__":
    run("headers", check)
