#!/usr/bin/python3
"""Stands in for LinuxCNC's user interface: homes, plays every program of the folder, each from X0 Y0 Z0, and writes
the commanded positions of each servo period to PROGRAM.samples."""

import os
import pathlib
import subprocess
import sys
import time

import linuxcnc  # Debian installs it for the system's Python alone

LONGEST_S = 300


def wait_until(condition, seconds):
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            sys.exit(f"LinuxCNC is not ready after {seconds} s")
        time.sleep(0.02)


class Player:
    def __init__(self):
        self.command, self.status = linuxcnc.command(), linuxcnc.stat()
        self.errors = linuxcnc.error_channel()

    def set(self, order, *values):
        order(*values)
        self.command.wait_complete(60)

    def polled(self):
        self.status.poll()
        message = self.errors.poll()
        if message:
            sys.exit(f"LinuxCNC: {message[1]}")
        return self.status

    def at_rest(self):
        now = self.polled()
        return now.interp_state == linuxcnc.INTERP_IDLE and now.exec_state == linuxcnc.EXEC_DONE and now.inpos

    def make_ready(self):
        self.set(self.command.state, linuxcnc.STATE_ESTOP_RESET)
        self.set(self.command.state, linuxcnc.STATE_ON)
        self.set(self.command.mode, linuxcnc.MODE_MANUAL)
        self.set(self.command.home, -1)
        wait_until(lambda: all(self.polled().homed[:3]), 20)

    def play(self, program):
        self.set(self.command.mode, linuxcnc.MODE_MDI)
        self.set(self.command.mdi, "G0 X0 Y0 Z0")
        wait_until(self.at_rest, 60)
        self.set(self.command.mode, linuxcnc.MODE_AUTO)
        self.set(self.command.program_open, str(program))
        part, whole = program.with_suffix(".part"), program.with_suffix(".samples")
        with part.open("w") as out:
            sampler = subprocess.Popen(["halsampler", "-t"], stdout=out)
            record("1")
            self.set(self.command.auto, linuxcnc.AUTO_RUN, 0)
            time.sleep(0.5)
            wait_until(self.at_rest, LONGEST_S)
            record("0")
            time.sleep(0.3)  # the reader is never far behind
            sampler.terminate()
            sampler.wait()
        part.rename(whole)


def record(on):
    subprocess.run(["halcmd", "sets", "record", on], check=True)


def main():
    folder = pathlib.Path(sys.argv[sys.argv.index("-ini") + 1]).resolve().parent
    os.chdir(folder)
    time.sleep(1)  # until the task listens
    player = Player()
    player.make_ready()
    for program in sorted(folder.glob("*.ngc")):
        player.play(program)


if __name__ == "__main__":
    main()
