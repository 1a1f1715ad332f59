"""Runs the two interpreters on one program file."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import canonical

HERE = pathlib.Path(__file__).resolve().parent
TOOLS = HERE / "tools.tbl"
BLOCK_DELETE = "(block delete on)"
SKIPPED = 77  # exit code ctest takes as "not run"


def default_vcnc():
    return os.environ.get("VCNC_PEER_VCNC") or str(HERE.parents[1] / "build/release/bin/vcnc")


class Timeout(Exception):
    pass


def _run(command, seconds, home=None):
    environment = {**os.environ, "HOME": home} if home else None
    try:
        done = subprocess.run(command, capture_output=True, timeout=seconds, cwd=home, env=environment, check=False)
    except subprocess.TimeoutExpired as late:
        raise Timeout(f"{command[0]} still runs after {seconds} s") from late
    return done.returncode, done.stdout.decode(errors="replace"), done.stderr.decode(errors="replace")


class Rs274:
    """LinuxCNC's interpreter, each run with a home of its own: two would share ~/.tool.mmap, their tool table."""

    def __init__(self):
        self.table = canonical.tool_table_in_inches(TOOLS.read_text())

    @staticmethod
    def installed():
        return shutil.which("rs274") is not None

    def run(self, program, seconds=60):
        flags = ["-b"] if block_delete(program) else []
        with tempfile.TemporaryDirectory(prefix="vcnc-peer-") as home:
            table = pathlib.Path(home) / "tools.tbl"
            table.write_text(self.table)
            code, out, err = _run(["rs274", "-t", str(table), "-g", *flags, str(program)], seconds, home)
        if code < 0:
            err += f"\nrs274 was killed by signal {-code}"
        return canonical.read_rs274(out, err, code)


class Vcnc:
    def __init__(self, binary):
        if shutil.which(binary) is None:
            sys.exit(f"{binary}: no such program; build vcnc or give --vcnc PATH")
        self.binary = binary

    def refusal(self, program, seconds=60):
        """(exit code, what it says) without the path."""
        code, _, err = _run([self.binary, "interpret", str(program), "--tools", str(TOOLS), "--json", os.devnull]
                            + self._options(program), seconds)
        return code, err.strip()

    def run(self, program, seconds=60):
        with tempfile.TemporaryDirectory(prefix="vcnc-peer-") as folder:
            target = pathlib.Path(folder) / "path.json"
            code, _, err = _run([self.binary, "interpret", str(program), "--tools", str(TOOLS), "--json", str(target)]
                                + self._options(program), seconds)
            if code == 0:
                return canonical.read_vcnc(target.read_text())
            return canonical.Path([], err.strip() or f"exit code {code}")

    @staticmethod
    def _options(program):
        options = ["--block-delete"] if block_delete(program) else []
        if str(program).endswith(".fanuc.nc"):
            options += ["--dialect", "fanuc"]
        if str(program).endswith(".siemens.nc"):
            options += ["--dialect", "siemens"]
        return options


def block_delete(program):
    with open(program, encoding="utf-8", errors="replace") as file:
        return file.readline().strip() == BLOCK_DELETE
