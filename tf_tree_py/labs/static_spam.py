# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A calibration sent at 100 Hz, or once as static: the cost, and the end of its sender."""

from functools import partial
import time
from typing import NamedTuple

from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import LATEST, Pose, Sample, TransformException
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.messages.wire import WireReader, write
from tf_tree_py.core.stamp import as_seconds, from_seconds

from .report import Axes, Column, Figure, Report, STYLES, Table

SUMMARY = 'a calibration sent at 100 Hz, or once: bytes, CPU, and when its sender dies'

RATE_HZ = 100
SUBSCRIBERS = 10
PARENT, CHILD, POSE = 'base_link', 'camera', Pose(0.2, 0.0, 0.8)
_CACHE = from_seconds(10.0)

_SECONDS = 10
_SPEED = 0.5
_DIES_AT = from_seconds(20.0)
_AFTER_S = (0.01, 0.5, 1.0, 2.0, 4.0, 6.0, 8.0, 9.9, 10.1, 12.0)


def message(stamp: int) -> bytes:
    """Return the calibration as the bytes of a TFMessage."""
    return write([Sample(PARENT, CHILD, stamp, POSE)])


class Cost(NamedTuple):
    """The cost of one way of sending, for all subscribers together."""

    how: str
    messages: int
    payload: int
    cpu_s: float
    samples: int


def cost(how: str, messages: int, *, static: bool) -> Cost:
    """Send messages to ten buffers, as bytes, as their listeners receive them."""
    buffers = [BufferCore(_CACHE) for _ in range(SUBSCRIBERS)]
    readers = [WireReader() for _ in range(SUBSCRIBERS)]
    wire = [message(from_seconds((number + 1) / RATE_HZ)) for number in range(messages)]
    begin = time.process_time()
    for data in wire:
        for reader, buffer in zip(readers, buffers, strict=True):
            buffer.insert_batch(reader.read(data), static=static)
    return Cost(how, messages * SUBSCRIBERS, sum(map(len, wire)) * SUBSCRIBERS,
                time.process_time() - begin, sum(edge.samples for buffer in buffers
                                                 for edge in buffer.edges()))


class Death(NamedTuple):
    """
    The results of lookups some seconds after the sender of the calibration died.

    :ivar stamped: with the stamp of an image of that moment: an exception, or an error in
        metres.
    :ivar latest: with the latest: an exception, or an error in metres.
    """

    after_s: float
    stamped: str | float
    latest: str | float


def deaths(*, static: bool) -> list[Death]:
    """Stop the calibration's sender while the robot drives on, and look up at some times."""
    period = from_seconds(1.0 / RATE_HZ)
    buffer = BufferCore(_CACHE)
    now, found = 0, []
    if static:
        buffer.insert(PARENT, CHILD, LATEST, POSE, static=True)
    for after_s in _AFTER_S:
        until = _DIES_AT + from_seconds(after_s)
        while now < until:
            now += period
            buffer.insert('map', PARENT, now, _map_T_base(now))
            if not static and now <= _DIES_AT:
                buffer.insert(PARENT, CHILD, now, POSE)
        found.append(Death(after_s, _off(buffer, now, now), _off(buffer, LATEST, now)))
    return found


def _map_T_base(stamp: int) -> PoseTuple:
    return Pose(x=_SPEED * as_seconds(stamp))


def _off(buffer: BufferCore, asked: int, now: int) -> str | float:
    """Return the error of the camera's position, metres, or the name of the exception."""
    try:
        found = buffer.lookup('map', CHILD, asked)
    except TransformException as error:
        return type(error).__name__.removesuffix('Exception')
    return abs(found.x - _SPEED * as_seconds(now) - POSE.x)


def run() -> Report:
    """Measure the cost of both ways, and the effect of the sender's end."""
    spam = cost(f'{RATE_HZ} Hz, as if it moved', RATE_HZ * _SECONDS, static=False)
    once = cost('once, static', 1, static=True)
    moving, fixed = deaths(static=False), deaths(static=True)
    stale = max(death.latest for death in moving if isinstance(death.latest, float))
    return Report(
        tables=[_cost_table([spam, once]), _death_table(moving, fixed)],
        law=f'sending {RATE_HZ} times a second takes {spam.messages // once.messages} '
            f'times as many messages in {_SECONDS} s; and when its sender dies, a lookup with a '
            f"stamp fails at once, the latest stops at the dead edge's last stamp (an error of up "
            f'to {stale:.1f} m here), and when the window of {as_seconds(_CACHE):.0f} s has '
            'passed it fails too. A static transform is valid for ever.',
        remarks=[
            "The bytes are those of the message, without DDS's overhead. The CPU time is that "
            f'of reading and storing, without DDS: {spam.cpu_s / spam.messages * 1e6:.0f} us per '
            'message. --ros measures processes.'],
        numbers={'bytes_per_message': spam.payload // spam.messages,
                 'messages_ratio': spam.messages // once.messages,
                 'cpu_s_per_message': spam.cpu_s / spam.messages, 'stale_m': stale},
        draw=partial(_draw, moving, fixed))


def _cost_table(costs: list[Cost]) -> Table:
    return Table(
        f'{_SECONDS} s, {SUBSCRIBERS} subscribers',
        (Column('how', 'the calibration is sent'), Column('messages', 'messages received'),
         Column('payload_bytes', 'payload [kB]', '.2f'),
         Column('cpu_s', 'CPU of storing [ms]', '.2f'), Column('samples', 'samples kept')), costs)


def _death_table(moving: list[Death], fixed: list[Death]) -> Table:
    return Table(
        f'map <- {CHILD} after the sender of {PARENT} -> {CHILD} died, while the robot drives on '
        f'at {_SPEED} m/s: the error, metres',
        (Column('after_s', 'after [s]', '.2f'),
         Column('moving_stamped', f"{RATE_HZ} Hz: an image's stamp", '.2f'),
         Column('moving_latest', 'the latest', '.2f'),
         Column('static_stamped', "static: an image's stamp", '.2f'),
         Column('static_latest', 'the latest', '.2f')),
        [(one.after_s, one.stamped, one.latest, other.stamped, other.latest)
         for one, other in zip(moving, fixed, strict=True)])


def _draw(moving: list[Death], fixed: list[Death], figure: Figure) -> None:
    axes, strip = figure.subplots(2, 1, sharex=True, height_ratios=(2.4, 1.0))
    answered = [death for death in moving if isinstance(death.latest, float)]
    axes.plot([death.after_s for death in answered], [death.latest for death in answered],
              **STYLES[2], label=f'{RATE_HZ} Hz on /tf, the latest')
    axes.plot([death.after_s for death in fixed], [death.stamped for death in fixed],
              **STYLES[0], label="once on /tf_static, the latest or an image's stamp")
    axes.set(yticks=range(7), ylabel='camera in map: off by [m]', ylim=(-0.4, 6.4),
             title=f'The sender of the calibration dies at 0 s; the robot drives at {_SPEED} m/s')
    _draw_outcomes(strip, moving, fixed)


def _draw_outcomes(axes: Axes, moving: list[Death], fixed: list[Death]) -> None:
    """Draw a bar for each kind of lookup: when it is right, wrong, or raises."""
    ways = (('/tf_static, either', fixed, 'stamped'),
            (f'{RATE_HZ} Hz, the latest', moving, 'latest'),
            (f"{RATE_HZ} Hz, image's stamp", moving, 'stamped'))
    for height, (_, deaths_, asked) in enumerate(ways):
        for begin, end, outcome in _stretches(deaths_, asked):
            axes.barh(height, end - begin, 0.7, begin, edgecolor='black', linewidth=0.8,
                      facecolor=_FILLS[outcome])
            axes.annotate(outcome, (0.5 * (begin + end), height), ha='center', va='center')
    axes.set_yticks(range(len(ways)), [name for name, *_ in ways])
    axes.set(xlabel=f'time since the sender died [s]; buffers keep {as_seconds(_CACHE):.0f} s',
             ylim=(-0.5, len(ways) - 0.5))
    axes.grid(axis='y', visible=False)


_FILLS = {'right': 'white', 'answers, but with an old pose': '#f6c9a8', 'raises': '#c9c9c9'}


def _stretches(found: list[Death], asked: str) -> list[tuple[float, float, str]]:
    """Return from when to when lookups have which outcome; a change lies between two of them."""
    begins: list[tuple[float, str]] = []
    for one, before in zip(found, [found[0], *found], strict=False):
        outcome = _outcome(getattr(one, asked))
        if not begins or outcome != begins[-1][1]:
            begins.append((0.5 * (before.after_s + one.after_s) if begins else 0.0, outcome))
    ends = [begin for begin, _ in begins[1:]] + [found[-1].after_s]
    return [(begin, end, outcome) for (begin, outcome), end in zip(begins, ends, strict=True)]


def _outcome(found: str | float) -> str:
    if isinstance(found, str):
        return 'raises'
    return 'right' if found < 1e-9 else 'answers, but with an old pose'
