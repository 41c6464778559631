"""Puts the generated stubs on the path: LAMBDAJET_PYTHON_STUBS, or build/release/python of this tree."""

import os
import pathlib
import sys

_SOURCE = pathlib.Path(__file__).resolve().parents[2]
_STUBS = pathlib.Path(os.environ.get("LAMBDAJET_PYTHON_STUBS", _SOURCE / "build" / "release" / "python"))
if str(_STUBS) not in sys.path:
    sys.path.insert(0, str(_STUBS))
