# SPDX-License-Identifier: Apache-2.0
"""How long Blender waits for the add-on: everything that it calls by itself (timers, panels, polls), timed."""

import functools
import importlib
import time

import bpy

spent: list[tuple[float, float, str]] = []  # wall seconds, seconds of this thread's processor time, name


def timed(name, function, *arguments):
    began, worked = time.perf_counter(), time.thread_time()
    try:
        return function(*arguments)
    finally:
        spent.append((time.perf_counter() - began, time.thread_time() - worked, name))


def time_the_addon(addon):
    """Time the package of this name from now on."""
    running_job, preflight, cycles_check, panel = (
        importlib.import_module(f"{addon}.{name}")
        for name in ("running.running_job", "check.preflight", "running.cycles_check", "panel")
    )
    the_tick, the_check, the_cycles_tick = running_job._tick, preflight._run, cycles_check._tick
    running_job._tick = lambda: timed("tick", the_tick)
    preflight._run = lambda: timed("check", the_check)
    cycles_check._tick = lambda: timed("cycles", the_cycles_tick)
    for part in (running_job.step, running_job._record_as_undo_step, running_job._start_next):  # of the tick
        setattr(running_job, part.__name__, functools.partial(timed, part.__name__, part))
    for cls in panel.CLASSES:
        if issubclass(cls, bpy.types.Panel):
            cls.draw = _timed_draw(cls)


def slowest(count=8):
    """The longest calls as text, in milliseconds of wall and, in brackets, processor time."""
    return ", ".join(
        f"{name} {wall * 1e3:.1f} ({work * 1e3:.1f})" for wall, work, name in sorted(spent)[: -count - 1 : -1]
    )


def _timed_draw(cls):
    draw = cls.draw
    return lambda self, context: timed(cls.__name__, draw, self, context)  # Blender counts the arguments
