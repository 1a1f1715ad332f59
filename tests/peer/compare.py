#!/usr/bin/env python3
"""Compares vcnc with LinuxCNC's rs274 on every program of a folder and on seeded random programs.

    compare.py [--vcnc PATH] [--only NAME] [--random N] [--seed S] [--keep FOLDER] [--verbose]

Prints one line for each program that is not the same and a table at the end. A difference that is wanted stands in
dialect.txt with its reason; an entry there that no longer differs is an error, too. Exit code 1 when anything
differs that is not in that file, 77 when rs274 is not installed.
"""

import argparse
import collections
import concurrent.futures
import math
import os
import pathlib
import re
import sys
import tempfile

import canonical
import interpreters
import random_programs

HERE = pathlib.Path(__file__).resolve().parent


def read_choices(path):
    """NAME | regex of the difference | reason"""
    choices = {}
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        fields = [field.strip() for field in line.split(" | ")]
        if len(fields) != 3 or not all(fields):
            sys.exit(f"{path}:{number}: expected NAME | regex of the difference | reason")
        choices[fields[0]] = (fields[1], fields[2])
    return choices


def compare(expected, got, text, contour):
    """None when both do the same, else a sentence. A random contour may be too narrow for the tool: then both refuse,
    or vcnc alone where only moves that are no neighbours tell, or where the inside corner before an arc lies behind its
    end: rs274 then goes round nearly the whole circle, which no arc of a contour asks for."""
    if contour and got.error and (expected.error or "leaves standing" in got.error):
        return None
    if contour and got.error and "an arc is too short" in got.error and _goes_round(expected):
        return None
    if expected.error:
        return f"rs274 refuses ({expected.error}), vcnc {'refuses, too: ' + got.error if got.error else 'does not'}"
    if got.error:
        return f"vcnc refuses: {got.error}"
    inches = re.search(r"G\s*20|G\[20", text, re.IGNORECASE) is not None
    return canonical.difference(expected, got, canonical.TOLERANCE_INCH_MM if inches else canonical.TOLERANCE_MM,
                                lines=canonical.LINES_NUMBERED in text, slide=contour)


def _goes_round(path):
    return any(segment.kind == "arc" and abs(canonical.arc_sweep(segment, before.end)[0]) > 1.9 * math.pi
               for before, segment in zip(path.segments, path.segments[1:]))


def judge(rs274, vcnc, program, twin=None):
    """(difference or None, motions compared)"""
    try:
        expected = rs274.run(program)
        got = vcnc.run(twin or program)
    except interpreters.Timeout as late:
        return str(late), 0
    except (ValueError, KeyError, TypeError, IndexError) as bad:
        return f"path not readable: {type(bad).__name__} {bad}", 0
    text = pathlib.Path(program).read_text()
    contour = pathlib.Path(program).name.startswith("random_contours")
    return compare(expected, got, text, contour), len(expected.segments)


def jobs_of(folder, count, seed, only, scratch):
    """name -> (rs274's program, vcnc's program)"""
    jobs = {}
    for program in sorted(folder.glob("*.ngc")):
        if program.name.endswith(".vcnc.ngc"):
            continue
        jobs[program.name] = (program, program)
        for ending in (".fanuc.nc", ".siemens.nc", ".vcnc.ngc"):
            twin = program.with_name(program.stem + ending)
            if twin.exists():
                jobs[twin.name] = (program, twin)
    for kind in random_programs.KINDS:
        for i in range(count):
            path = scratch / f"random_{kind}_{seed + i}.ngc"
            path.write_text(random_programs.program(kind, seed + i))
            jobs[path.name] = (path, path)
    for i in range(count):
        paths = (scratch / f"random_twin_{seed + i}.ngc", scratch / f"random_twin_{seed + i}.fanuc.nc")
        for path, text in zip(paths, random_programs.fanuc_twin(seed + i)):
            path.write_text(text)
        jobs[paths[0].name], jobs[paths[1].name] = (paths[0], paths[0]), paths
    return {name: job for name, job in jobs.items() if re.search(only, name)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vcnc", default=interpreters.default_vcnc(), help="the vcnc program (VCNC_PEER_VCNC)")
    parser.add_argument("--programs", type=pathlib.Path, default=HERE / "programs")
    parser.add_argument("--dialect", type=pathlib.Path, default=HERE / "dialect.txt")
    parser.add_argument("--only", default="", metavar="REGEX", help="programs whose name matches")
    parser.add_argument("--random", type=int, default=0, metavar="N", help="random programs of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=pathlib.Path, help="write random programs here and keep them")
    parser.add_argument("--jobs", type=int, default=min(os.cpu_count() or 1, 4))
    parser.add_argument("--verbose", action="store_true", help="a line for programs that are the same, too")
    options = parser.parse_args()

    if not interpreters.Rs274.installed():
        print("skipped: no rs274 (package linuxcnc-uspace)")
        return interpreters.SKIPPED
    choices = read_choices(options.dialect)
    rs274, vcnc = interpreters.Rs274(), interpreters.Vcnc(options.vcnc)
    with tempfile.TemporaryDirectory(prefix="vcnc-peer-") as scratch:
        if options.keep:
            options.keep.mkdir(parents=True, exist_ok=True)
        jobs = jobs_of(options.programs, options.random, options.seed, options.only,
                       options.keep or pathlib.Path(scratch))
        if not jobs:
            sys.exit(f"no program in {options.programs} matches {options.only!r}")
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            results = dict(zip(jobs, pool.map(lambda job: judge(rs274, vcnc, *job), jobs.values())))
    return report(results, choices, options)


def report(results, choices, options):
    tally, motions = collections.defaultdict(collections.Counter), 0
    for name, (text, count) in results.items():
        motions += count
        pattern, reason = choices.get(name, (None, None))
        if text is None and pattern is None:
            verdict = "same"
        elif text is None:
            verdict = "DIFFERS"
            text = "is the same, but stands in the dialect file: take it out"
        elif pattern is not None and re.search(pattern, text):
            verdict = "dialect choice"
            text = reason
        else:
            verdict = "DIFFERS"
        group = "random" if name.startswith("random_") else name.split("_")[0].split(".")[0]
        tally[group][verdict] += 1
        if verdict == "DIFFERS" or options.verbose:
            print(f"{name}: {verdict}" + (f": {text}" if text else ""))
    if not options.only:
        for name in sorted(set(choices) - set(results)):
            if not name.startswith("random_"):
                tally["dialect.txt"]["DIFFERS"] += 1
                print(f"{name}: DIFFERS: stands in the dialect file, but there is no such program")
    print(f"\n{'':14}{'same':>8}{'dialect':>9}{'DIFFERS':>9}")
    total = collections.Counter()
    for group, counts in sorted(tally.items()) + [("all", None)]:
        counts = total if counts is None else counts
        print(f"{group:14}{counts['same']:>8}{counts['dialect choice']:>9}{counts['DIFFERS']:>9}")
        if counts is not total:
            total.update(counts)
    print(f"{motions} motions compared")
    return 1 if total["DIFFERS"] else 0


if __name__ == "__main__":
    sys.exit(main())
