#!/usr/bin/env python3
"""Checks that vcnc refuses every wrong program of a folder with the line and the reason.

    refused.py [--vcnc PATH] [--only REGEX] [--rs274] [--verbose]

The first line of a program is `(refused: LINE REASON)` or `(refused: LINE:COLUMN REASON)`: where it is wrong, LINE being
ANY where several lines are equally to blame, and a regex of what the message must name. The message is one line. Where the lines
before the wrong one can stand alone, they must be accepted: that the refusal is about this line and no other is
what the test is for. With --rs274 it is counted, not judged, how many of them rs274 refuses, too.
"""

import argparse
import collections
import concurrent.futures
import os
import pathlib
import re
import sys
import tempfile
import time

import interpreters

HERE = pathlib.Path(__file__).resolve().parent
_HEADER = re.compile(r"\(refused: (\d+|ANY)(?::(\d+))? (.+)\)$")
_PLACE = re.compile(r"(?:\.ngc|\.nc):(\d+)(?::(\d+))?")
_OPEN_STATE = re.compile(r"(?im)^\s*o|%|G4[12]|DO\d|WHILE|^N\d+ *#")
TIME_LIMIT_S = 60


def generated(folder):
    """Programs too long to keep as files."""
    many = 100_000
    programs = {
        "last_line.ngc": (many, "K", ["G1 F100 X0"] + [f"X{i % 97}.{i % 10} Y{i % 89}" for i in range(many - 3)]
                          + ["G2 X5 K3"]),
        "last_line_inside_loop.ngc": (many + 2, "zero|divi", ["G1 F100 X0", "#1=1"]
                                      + [f"X{i % 97} Y{i % 89}" for i in range(many - 4)]
                                      + ["o1 while [#1 GE 0]", "#1=[#1-1]", "X[1/#1]", "o1 endwhile", "M2"]),
        "unclosed_at_the_end.ngc": ("ANY", "o?1|endif|if", ["G1 F100 X0", "o1 if [1]"]
                                    + [f"X{i % 97}" for i in range(many)] + ["M2"]),
        "deep_brackets.ngc": (2, r"\[|deep|nest|long|bracket", ["G1 F100 X" + "[" * 100_000 + "1" + "]" * 100_000,
                                                              "M2"]),
        "deep_functions.ngc": (2, r"deep|nest|long|bracket", ["G1 F100 X" + "ABS[" * 50_000 + "1" + "]" * 50_000,
                                                             "M2"]),
        "deep_ifs.ngc": ("ANY", "deep|nest|if", [f"o{i} if [1]" for i in range(20_000)] + ["M2"]),
        "deep_recursion.ngc": ("ANY", "recurs|depth|deep|level|call|nest",
                               ["o1 sub", "o2 if [#1 GT 0]", "o1 call [#1-1]", "o2 endif", "o1 endsub",
                                "o1 call [1000000]", "M2"]),
        "endless_motion.ngc": ("ANY", "endless|loop|limit|blocks|repeat|while",
                               ["G1 F100 X0", "o1 while [1]", "X1", "X0", "o1 endwhile", "M2"]),
        "endless_repeat.ngc": ("ANY", "endless|loop|limit|blocks|repeat|large",
                               ["G1 F100 X0", "o1 repeat [1000000000000000]",
                                "#1=[#1+1]", "o1 endrepeat", "M2"]),
        "endless_cycle.ngc": ("ANY", "L|limit|blocks|range", ["G81 F100 X0 Z-1 R1 L1000000000", "M2"]),
        "endless_pecks.ngc": ("ANY", "Q|limit|blocks|range|peck", ["G83 F100 X0 Z-1000 R1 Q0.000000001", "M2"]),
        "long_word.ngc": (2, "X|number|digit|range|long", ["G1 F100 X" + "1" * 1_000_000, "M2"]),
        "long_name.ngc": (2, "name|long|unknown|set|#", ["G1 F100 X#<" + "a" * 1_000_000 + ">", "M2"]),
    }
    for name, (line, reason, lines) in programs.items():
        path = folder / f"generated_{name}"
        path.write_text(f"(refused: {line} {reason})\n" + "\n".join(lines) + "\n")
        yield path
    binary = folder / "generated_binary.ngc"
    binary.write_bytes(b"(refused: 2 .)\n" + bytes(range(256)) * 16)
    yield binary


def judge(vcnc, rs274, program):
    """(what is wrong or None, whether rs274 refuses too or None)"""
    text = program.read_bytes().decode(errors="replace")
    lines = text.split("\n")
    header = _HEADER.match(lines[0])
    if not header:
        return "the first line must be (refused: LINE REASON) or (refused: LINE:COLUMN REASON)", None
    line, column, reason = header.groups()
    try:
        code, said = vcnc.refusal(program, TIME_LIMIT_S)
    except interpreters.Timeout as late:
        return str(late), None
    wrong = _wrong_message(code, said, line, column, reason)
    if wrong is None and line != "ANY":
        wrong = _wrong_before(vcnc, program, lines[:int(line) - 1])
    too = None
    if rs274 and not program.name.endswith((".fanuc.nc", ".siemens.nc")):
        try:
            too = rs274.run(program, 3).error is not None
        except interpreters.Timeout:
            too = False
    return wrong, too


def _wrong_message(code, said, line, column, reason):
    if code == 0:
        return "accepted"
    if code not in (1, 2):
        return f"exit code {code}: {said[:300]}"
    if "\n" in said:
        return f"more than one line: {said[:300]}"
    if len(said) > 2000:
        return f"a message of {len(said)} characters"
    place = _PLACE.search(said)
    if line != "ANY" and (not place or place.group(1) != line):
        return f"expected line {line}: {said}"
    if place and not place.group(2):
        return f"no column: {said}"
    if column and place.group(2) != column:
        return f"expected column {column}: {said}"
    message = said[place.end():] if place else said
    if not re.search(reason, message, re.IGNORECASE):
        return f"expected a reason like /{reason}/: {said}"
    return None


def _wrong_before(vcnc, program, before):
    text = "\n".join(before[1:])
    if len(before) < 2 or _OPEN_STATE.search(text):
        return None
    with tempfile.TemporaryDirectory(prefix="vcnc-peer-") as folder:
        path = pathlib.Path(folder) / program.name
        path.write_text(text + ("\nM30\n" if program.name.endswith(".nc") else "\nM2\n"))
        code, said = vcnc.refusal(path, TIME_LIMIT_S)
    return f"the lines before are refused, too: {said}" if code else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vcnc", default=interpreters.default_vcnc(), help="the vcnc program (VCNC_PEER_VCNC)")
    parser.add_argument("--programs", type=pathlib.Path, default=HERE / "refused")
    parser.add_argument("--only", default="", metavar="REGEX")
    parser.add_argument("--rs274", action="store_true", help="count what rs274 refuses, too")
    parser.add_argument("--jobs", type=int, default=min(os.cpu_count() or 1, 4))
    parser.add_argument("--verbose", action="store_true")
    options = parser.parse_args()

    vcnc = interpreters.Vcnc(options.vcnc)
    rs274 = interpreters.Rs274() if options.rs274 and interpreters.Rs274.installed() else None
    with tempfile.TemporaryDirectory(prefix="vcnc-peer-") as scratch:
        programs = sorted(options.programs.glob("*.n*c")) + list(generated(pathlib.Path(scratch)))
        programs = [p for p in programs if re.search(options.only, p.name)]
        if not programs:
            sys.exit(f"no program in {options.programs} matches {options.only!r}")
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            started = time.monotonic()
            results = list(pool.map(lambda p: judge(vcnc, rs274, p), programs))
    tally = collections.Counter()
    for program, (wrong, too) in zip(programs, results):
        tally["WRONG" if wrong else "refused"] += 1
        tally["rs274", too] += 1
        if wrong or options.verbose:
            print(f"{program.name}: {wrong or 'refused'}" + ("" if too is not False else " (rs274 does not refuse)"))
    print(f"\n{len(programs)} wrong programs: {tally['refused']} refused with line and reason, {tally['WRONG']} not; "
          f"{time.monotonic() - started:.1f} s")
    if rs274:
        print(f"rs274 refuses {tally['rs274', True]} of {tally['rs274', True] + tally['rs274', False]}")
    return 1 if tally["WRONG"] else 0


if __name__ == "__main__":
    sys.exit(main())
