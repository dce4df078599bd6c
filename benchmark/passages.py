# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""All passages of the documentation that quote a result; see ``figures``."""

from collections.abc import Iterable
from functools import partial

from .figures import Commit, Date, FasterUpTo, Figure, Measured, Number, Passage, Ratio
from .rows import (
    ALONE,
    CORE,
    DEBIAN,
    DOCTOR,
    GTSAM,
    JAZZY,
    KINHEC,
    OURS,
    PLAIN,
    PURE,
    PYTRANSFORM,
    RUST,
    SHARED,
    TF2_ROS,
    TF_DOCTOR,
    TF_MONITOR,
    TF_SHARE,
)

_RUN = 'performance_lookups.md'
_RECENT, _DEPTHS = '30 ms old', (1, 5, 10, 15, 38)
_STREAM, _SMALL_STREAM = '38 x 500 Hz', '1 x 1000 Hz'
# Of the control loop, with a listener and without one.
_LOOP, _ALONE = f'{_STREAM}: ', f'{_STREAM}, no listener: '
_BAG = '3600 s, uncompressed', '3600 s, zstd'
# An hour of 38 edges at 100 Hz.
_TRANSFORMS_OF_BAG = 3600 * 100 * 38
# Of KinHEC, as calibration.md describes them.
_TRACKS = {'noise': 'noise', 'motion': 'motion, some of it with hardly any rotation',
           'outliers': 'outliers', 'temporal': 'temporal'}
_STATISTICS = 'mean', 'median', '90th percentile'


def _depth(contestant: str, depth: int, where: str = _RECENT) -> Measured:
    return _fastest('depth', f'{where}, depth {depth}', contestant)[0]


def _depths(contestant: str, depths: Iterable[int], where: str = _RECENT) -> list[Measured]:
    return [_depth(contestant, depth, where) for depth in depths]


def _of(group: str, name: str, *contestants: str, factor: float = 1.0) -> list[Measured]:
    """Return one row of several contestants."""
    return [Measured(group, name, factor=factor, contestant=each) for each in contestants]


def _fastest(group: str, name: str, *contestants: str) -> list[Measured]:
    """
    Return the fastest round of several contestants.

    Other programs on the machine slow down whole rounds. If that happens to about half of them,
    one contestant's median is that of a slow round, and another's that of a fast one.
    """
    return [Measured(group, name, 'least', contestant=each) for each in contestants]


def _late(contestant: str) -> tuple[Number, ...]:
    """Return how late a loop wakes, with the ends, which are far apart."""
    return Measured('control', f'{_LOOP}the loop wakes late, p99',
                    contestant=contestant).and_ends()


def _many(name: str, *contestants: str) -> list[Measured]:
    return _fastest('many', f'{name} stamps, sorted', *contestants)


def _readme() -> Iterable[Passage]:
    say = partial(Passage, 'README.md')
    yield say('of a waiting lookup, median | {} ms | {} ms | `wait` |',
              _of('wait', 'over DDS, p50', TF2_ROS, OURS))
    yield say('at 500 Hz: CPU of a core | {} % | {} % | `control` |',
              _of('control', f'{_LOOP}CPU', TF2_ROS, OURS))
    yield say('99th percentile | {} ms ({} to {}) | {} ms ({} to {}) | `control` |',
              _late(TF2_ROS) + _late(OURS))
    yield say('median, after a sleep | {} us | {} us | `control` |',
              _of('control', f'{_LOOP}a lookup, p50', TF2_ROS, OURS))
    yield say('38 transforms at 500 Hz, per message | {} ms | {} ms | `listener` |',
              _of('listener', _STREAM, TF2_ROS, OURS, factor=1e-3))
    for depth in 1, 5, 10, 38:
        edges = 'edge' if depth == 1 else 'edges'
        yield say(f'over {depth} moving {edges} | {{}} us | {{}} us | `depth` |',
                  [_depth(TF2_ROS, depth), _depth(OURS, depth)])
    for depth in 10, 38:
        yield say(f'over {depth} moving edges, in pure Python | {{}} us | {{}} us | `depth` |',
                  [_depth(TF2_ROS, depth), _depth(PURE, depth)])
    yield say("a loop over tf2's C++ buffer | {} ms | {} ms | `many` |",
              _many('100,000', JAZZY, OURS))
    yield say('(those of listeners at the same time), in the run of {}.', [Date(_RUN)])
    yield say('at the depths in the table, a lookup over up to {} moving edges takes no longer', [
        FasterUpTo(_RECENT, TF2_ROS, (1, 5, 10, 38))])
    yield say('in pure Python, over up to {}.', [
        FasterUpTo(_RECENT, TF2_ROS, (1, 5, 10, 38), PURE)])


def _performance() -> Iterable[Passage]:
    say = partial(Passage, 'docs/performance.md')
    yield say('the run of {} (commit {})', [Date(_RUN), Commit(_RUN)])
    five = ', '.join(['{}'] * 5)
    yield say(f'over 1, 5, 10, 15, 38 moving edges | {five} us | `tf2_ros` of Jazzy, from Python '
              f"| {five} us | | | | tf2's C++ buffer alone (Jazzy), from Python | {five} us |",
              [figure for way in (OURS, TF2_ROS, JAZZY) for figure in _depths(way, _DEPTHS)])
    four = ', '.join(['{}'] * 4)
    yield say(f'10 s of history, over 1, 5, 10, 38 edges | {four} us | `tf2_ros` | {four} us |',
              [figure for way in (OURS, TF2_ROS)
               for figure in _depths(way, (1, 5, 10, 38), f'{_RECENT}, 10 s of history')])
    yield say(f'the latest lookup over 1, 5, 10, 15, 38 edges | {five} us | `tf2_ros` | {five} us '
              '|', [figure for way in (OURS, TF2_ROS)
                    for figure in _depths(way, _DEPTHS, 'latest')])
    yield say(f'in pure Python, over 1, 5, 10, 15, 38 edges | {five} us | `tf2_ros` | {five} us |',
              [figure for way in (PURE, TF2_ROS) for figure in _depths(way, _DEPTHS)])
    yield say(f'(`BufferCore.lookup`), over 1, 5, 10, 15 edges | {four} us | Rust '
              f'(`transform-tree`), with a plan made in advance | {four} us |',
              [figure for way in (CORE, RUST) for figure in _depths(way, _DEPTHS[:-1])])
    yield say("| 100,000 stamps in a row, over 3 edges | {} ms | a loop over tf2's C++ buffer "
              '(Jazzy) | {} ms | | | | Rust | {} ms | | | | pytransform3d, which gets all samples '
              'in advance | {} ms |', _many('100,000', OURS, JAZZY, RUST, PYTRANSFORM))
    yield say('| 1,000 stamps in a row, over 3 edges | {} ms | Rust | {} ms |',
              _many('1,000', OURS, RUST))
    yield say("| {} us | a loop over tf2's C++ buffer (Jazzy) | {} us |",
              _fastest('tree', 'all frames, middle', OURS, JAZZY))
    yield say("`set_transform` | {} us | tf2's C++ buffer (Jazzy), from Python | {} us |",
              _fastest('insert', '38 in a message', f'{OURS}, one by one',
                       f'{JAZZY}, one by one'))
    yield say('the covariance of a lookup over 5 edges | {} us | GTSAM, from Python | {} us |',
              _fastest('uncertain', '5 moving edges', 'lookup_uncertain', GTSAM))
    yield say('38 transforms at 500 Hz | {} us | `tf2_ros` | {} us | | | | an rclpy subscription '
              'with an empty callback | {} us |', _of('listener', _STREAM, OURS, TF2_ROS, PLAIN))
    yield say('one transform at 1,000 Hz | {} us | `tf2_ros` | {} us | | | | the empty callback | '
              '{} us |', _of('listener', _SMALL_STREAM, OURS, TF2_ROS, PLAIN))
    yield say('waiting lookup, over DDS | {} ms | `tf2_ros` | {} ms | | | | the callback of a '
              'plain subscription | {} ms |', _of('wait', 'over DDS, p50', OURS, TF2_ROS, PLAIN))
    yield say('control loop, 38 transforms at 500 Hz | {} us | `tf2_ros` | {} us |',
              _of('control', f'{_LOOP}a lookup, p50', OURS, TF2_ROS))
    yield say('how late that loop wakes, 99th percentile | {} ms ({} to {}) | `tf2_ros` | {} ms '
              '({} to {}) |', _late(OURS) + _late(TF2_ROS))
    yield say("memory of a sample | {} bytes | tf2's C++ buffer (Debian) | {} bytes |",
              _of('memory', '1,000,000 samples', OURS, DEBIAN))
    yield say('per transform | {} us | a loop over rosbags | {} us | | | | Rust | {} us | | | | '
              "rosbags' raw bytes, not decoded | {} us |",
              _of('bag', _BAG[0], OURS, 'rosbags, a loop', RUST, 'rosbags, raw'))
    yield say('a lookup of 30 ms ago over up to {} moving edges takes no longer here', [
        FasterUpTo(_RECENT, TF2_ROS, _DEPTHS)])
    yield say('in pure Python, over up to {} edges.', [
        FasterUpTo(_RECENT, TF2_ROS, _DEPTHS, PURE)])
    yield say('is slower than a lookup here over up to {} edges', [
        FasterUpTo(_RECENT, JAZZY, (1, 2, 3, *_DEPTHS[1:]))])


def _details() -> Iterable[Passage]:
    """Yield the passages of the pages that have the tables."""
    yield Passage('docs/performance_lookups.md',
                  "A loop over tf2's C++ buffer (Debian) takes {} times as long.",
                  [Ratio('tree', 'all frames of the humanoid', inverse=True,
                         unit='x a loop of C++ tf2')])
    yield Passage('docs/performance_nodes.md',
                  'One transform at 1,000 Hz takes {} of it, 5 at 500 Hz {}, 38 at 100 Hz {}, and '
                  '38 at 500 Hz {}.',
                  [Ratio('listener', name, unit=f'x {PLAIN}')
                   for name in (_SMALL_STREAM, '5 x 500 Hz', '38 x 100 Hz', _STREAM)])
    yield Passage('docs/performance_nodes.md', 'which does nothing else, takes {} ms.',
                  _of('wait', 'over DDS, p50', PLAIN))
    yield from _control_loop()
    yield Passage('docs/performance_data.md',
                  'takes {} times as long as handing out its raw bytes, where the target was 4, '
                  'and one in zstd {} times,',
                  [Ratio('bag', name, unit='x rosbags, raw') for name in _BAG])
    yield Passage('docs/performance_data.md', 'the uncompressed one takes {} times as long',
                  [Ratio('bag', _BAG[0], unit=f'x {RUST}')])
    yield Passage('docs/performance_data.md', 'An open bag takes {} bytes a transform,',
                  _of('bag', f'{_BAG[0]}: memory', f'{OURS}, in the end'))


def _control_loop() -> Iterable[Passage]:
    say = partial(Passage, 'docs/performance_nodes.md')
    lookup, late = 'a lookup, p50', 'the loop wakes late, p99'
    yield say('Without a listener it takes {} us, and {} us with tf2_ros.',
              _of('control', f'{_ALONE}{lookup}', OURS, TF2_ROS))
    yield say('it takes less, {} us and {} us:', _of('control', f'{_LOOP}{lookup}', OURS, TF2_ROS))
    yield say('it wakes {} ms late (99th percentile);', _of('control', f'{_LOOP}{late}', OURS))
    yield say('Without a listener, it wakes {} ms late.', _of('control', f'{_ALONE}{late}', OURS))


def _nodes() -> Iterable[Passage]:
    """Yield those of the pages of tools and nodes."""
    def of_doctor(name: str) -> Ratio:
        return Ratio('doctor', f'{_STREAM}: {name}', unit=f'x {OURS}')

    yield Passage('docs/doctor.md', 'with a doctor takes {} times the CPU', [of_doctor(DOCTOR)])
    yield Passage('docs/tools.md',
                  '`tf_monitor` uses {} times the CPU of a listener alone, and `tf_doctor` {} '
                  'times',
                  [of_doctor(TF_MONITOR), of_doctor(TF_DOCTOR)])
    yield Passage('docs/robot_description.md',
                  'cost {} of the CPU of a plain rclpy subscription with an empty callback if '
                  'every message is published, and {} of it',
                  [Ratio('joints', f'40 x 500 Hz, sent at {rate} Hz', unit=f'x {PLAIN}')
                   for rate in (500, 20)])
    yield Passage('docs/several_robots.md',
                  '38 transforms takes {} us of CPU, and {} us if two of them are wanted',
                  _of('insert', '38 in a message', f'{OURS}, wire bytes', f'{OURS}, two wanted',
                      factor=38.0))
    yield Passage('docs/installing.md', 'over 38 moving edges takes {} us instead of {} us, and '
                  'over one edge {} us instead of {} us',
                  [_depth(way, depth) for depth in (38, 1) for way in (OURS, PURE)])


def _recordings() -> Iterable[Passage]:
    say = partial(Passage, 'docs/recorded_trees.md')
    for words, way in (
            ('| `open_bag` | {} | {} |', OURS),
            ('which is a part of that | {} | {} |', 'rosbags, raw'),
            ('its import of MCAP | {} | {} |', RUST),
            ('deserialises each message | {} | {} |', 'rosbags, a loop')):
        yield say(words, [Measured('bag', name, factor=_TRANSFORMS_OF_BAG * 1e-6, contestant=way)
                          for name in _BAG])
    yield say('A transform takes {} bytes in memory',
              _of('bag', f'{_BAG[0]}: memory', f'{OURS}, in the end'))
    yield say('and one lookup take {} ms together',
              _of('bag', 'a saved tree of *, and a lookup', OURS))


def _fleet() -> Iterable[Passage]:
    say = partial(Passage, 'docs/fleet.md')
    counts = 1, 10, 100
    names = [f'{count} robots x 25 x 10 Hz' for count in counts]
    yield say('CPU of the listener per message | {} us | {} us | {} us |',
              [Measured('fleet', name) for name in names])
    # Each robot sends ten messages a second.
    yield say('as a share of one core | {} % | {} % | {} % |',
              [Measured('fleet', name, factor=count * 10 * 1e-4)
               for name, count in zip(names, counts, strict=True)])
    for words, peer in (('that does nothing | {} | {} | {} |', 'plain Zenoh'),
                        ('setting each transform | {} | {} | {} |', 'by hand')):
        yield say(words, [Ratio('fleet', name, unit=f'x {peer}') for name in names])
    for words, statistic in (('that waits for it, median | {} ms | {} ms | {} ms |', 'median'),
                             ('the same, 99th percentile | {} ms | {} ms | {} ms |', 'p99')):
        yield say(words, [Measured('fleet_lag', f'{name}: publication to lookup',
                                   contestant=statistic) for name in names])
    yield say('| messages lost | {} | {} | {} |',
              [Ratio('fleet', f'{name}: messages lost') for name in names])
    sent, off = '25 of 40 frames at 50 Hz, *', 'interpolated, at worst off by'
    yield say('(the messages alone, as on DDS) | {} |',
              _of('fleet_link', sent, 'plain messages', factor=1e-3))
    yield say('| none | {} | 0 | 0 |', _of('fleet_link', sent, '50 Hz, 0 mm', factor=1e-3))
    for words, limits in (('| 0.001 | {} | {} mm |', '50 Hz, 1 mm'),
                          ('| 0.01 | {} | {} mm |', '50 Hz, 10 mm'),
                          ('| 0.05 | {} | {} mm |', '50 Hz, 50 mm'),
                          ('| 10 Hz | {} | {} mm |', '10 Hz, 0 mm'),
                          ('| 10 Hz, 0.001 | {} | {} mm |', '10 Hz, 1 mm')):
        yield say(words, [*_of('fleet_link', sent, limits, factor=1e-3),
                          *_of('fleet_link', off, limits)])
    yield say('one listener can receive some {} such robots',
              [Measured('fleet', names[-1], factor=1e5, inverse=True)])
    yield say('A thousand robots at 10 Hz send {} MB a second, or {} if they rest',
              [Measured('fleet_link', sent, factor=1e-3, contestant=f'10 Hz, {move}')
               for move in ('0 mm', '1 mm')])


def _beyond() -> Iterable[Passage]:
    say = partial(Passage, 'docs/beyond_tf2.md')
    plain = 'x a plain lookup'
    yield say('of the same run ({} us there)', _of('uncertain', '5 moving edges', 'plain'))
    for words, name, unit in (
            ('`lookup` over edges with covariances |', 'a plain lookup of uncertain edges',
             'x one of certain edges'),
            ('`lookup` over corrected edges |', 'a plain lookup of corrected edges',
             'x one of edges that never were'),
            ('again between the same two poses |', 'the same, edges aided', plain),
            ('`lookup_uncertain`, 0.1° per edge |', 'lookup_uncertain', plain),
            ('`lookup_uncertain`, 2° per edge |', 'lookup_uncertain, 2 deg', plain),
            ('`lookup_budget`, 0.1° per edge |', 'lookup_budget', plain),
            ('for each of 1,000 stamps |', 'lookup_uncertain_many, each of 1,000', plain),
            ('50 ms ahead, not the first one |', 'predict, 50 ms ahead', plain),
            ('the same, each after new samples |', 'predict, each after new samples', plain)):
        yield say(f'{words} {{}} ({{}} to {{}})', Ratio('uncertain', name, unit=unit).and_ends())
    for words, name in (
            ('`lookup(..., max_age=...)`, of the latest |', 'the latest, with max_age'),
            ('`lookup` of the latest, with `max_age` of the buffer |',
             'the latest, with the max_age of the buffer'),
            ('`lookup_newest` |', 'lookup_newest')):
        yield say(f'{words} {{}} ({{}} to {{}}) times one of the latest',
                  Ratio('uncertain', name, unit='x the latest').and_ends())
    yield say('it takes {} times as long as GTSAM',
              [Ratio('uncertain', 'lookup_uncertain', unit=f'x {GTSAM}')])


def _continuous() -> Iterable[Passage]:
    say = partial(Passage, 'docs/continuous_time.md')
    spline = f'{OURS}, a spline'
    yield say('with one spline | {} ms | {} ms: transform-tree (Rust), which interpolates '
              'linearly; {} ms: without the spline |',
              _of('continuous', '100,000 events in 0.1 s', spline, RUST, OURS))
    yield say('100,000 events in 5 s, the same path | {} ms | {} ms: transform-tree; {} ms: '
              'without the spline |',
              _of('continuous', '100,000 events in 5 s', spline, RUST, OURS))
    yield say('one lookup, the same path | {} us | {} us: without the spline |',
              _of('continuous', 'one lookup, depth 3', spline, OURS))
    yield say('50 knots a second | {} ms | {} ms: on SE(3) |',
              [Measured('continuous', f'fit 1 s of 1 kHz, 50 knots/s, {group}')
               for group in ('R3 x SO(3)', 'SE(3)')])
    yield say('`SplineFitter.add` at 1 kHz | {} ms for one pose | {} ms for ten poses at once |',
              _of('continuous', 'add poses at 1 kHz as they come', f'{OURS}, 1 at a time',
                  f'{OURS}, 10 at a time'))


def _calibration() -> Iterable[Passage]:
    say = partial(Passage, 'docs/calibration.md')
    edges = '2,000 observations over 5 moving edges'
    yield say('over five moving edges: {} s, and {} s of CPU.',
              [Measured('calibration', name) for name in (edges, f'CPU for {edges}')])
    errors = '{}, {}, {}°; {}, {}, {} mm'
    for track, description in _TRACKS.items():
        yield say(f'| {description} | {errors} | {errors} |', [
            _error(track, statistic, unit, way)
            for way in (OURS, KINHEC) for unit in ('deg', 'mm') for statistic in _STATISTICS])
    yield say('a mean error of {} ms', [_error('temporal', 'mean', 'ms', OURS)])


def _error(track: str, statistic: str, unit: str, way: str) -> Figure:
    return Measured('calibration', f'KinHEC, {track}: {statistic} of *', of_unit=unit,
                    contestant=way)


def _growth() -> Iterable[Passage]:
    say = partial(Passage, 'docs/performance_growth.md')
    ends = '100', '100,000'
    yield say('of each of five edges takes {} us, and among 100,000 {} us (tf2_ros: {} us and {} '
              "us; tf2's C++ buffer of Debian: {} us and {} us).",
              [_fastest('growth_samples', f'old stamp, {count} samples', way)[0]
               for way in (OURS, TF2_ROS, DEBIAN) for count in ends])
    yield say('each costs {} times as much as of 10.',
              [Ratio('growth_frames', 'whole tree, 10,000 frames', unit='x 10 frames')])
    yield say('and an insertion {} times as much.',
              [Ratio('growth_frames', 'insertion, 10,000 frames', unit='x 10 frames')])
    yield say('answers {} lookups a second; two answer {} in total, and eight {} (tf2_ros: {}, {} '
              'and {}).',
              [Measured('growth_threads', f'in total, {count}', 'greatest', contestant=way)
               for way in (OURS, TF2_ROS) for count in ('1 thread', '2 threads', '8 threads')])
    yield say("takes {} bytes if an edge has 100 of them, and {} if it has 100,000. In tf2's C++ "
              'buffer (Jazzy) it takes {} or more.',
              [*(Measured('growth_memory', f'in all, {count} samples') for count in ends),
               *_of('growth_memory', 'in all, 1,000 samples', JAZZY)])
    yield say('Ten times as many messages cost {} times the CPU.',
              [Ratio('growth_rates', 'CPU, 5,000 Hz', unit='x 500 Hz')])
    yield say('Of 5,000 a second {} % arrive, and at least {} % at the plain subscription.',
              [Measured('growth_rates', 'arrived, 5,000 Hz', 'least', contestant=way)
               for way in (OURS, PLAIN)])
    each, one = 'open each, and a lookup', 'open as one bag'
    yield say('a single bag takes {} ms, and each of 300 {} ms if they are opened one by one, or '
              '{} ms as the parts of one bag. A lookup in that bag takes {} us with one part, and '
              '{} us with 300.',
              [Measured('growth_bags', name, 'least') for name in (
                  f'{each}, 1 bag', f'{each}, 300 bags', f'{one}, 300 bags',
                  'lookup in that, 1 bag', 'lookup in that, 300 bags')])


def _shared() -> Iterable[Passage]:
    say = partial(Passage, 'docs/shared_tree.md')
    loop = '1 x a loop of 100 Hz: CPU of each'
    for label, way in (('has no listener', ALONE), ('looks up in the shared tree', SHARED),
                       ('has a listener of its own', OURS),
                       ('has the listener of `tf2_ros`', TF2_ROS)):
        yield say(f'| {label} | {{}} % |', _of('shared', loop, way))
    yield say('| `tf_share`, once for all of them | {} % |', _of('shared', 'receiving', TF_SHARE))
    yield say('sample in its window: {} MB for 38 edges at 500 Hz and 10 s.',
              _of('shared', 'the file, in all rounds', TF_SHARE))


PASSAGES = [*_readme(), *_performance(), *_details(), *_nodes(), *_recordings(), *_fleet(),
            *_shared(), *_beyond(), *_continuous(), *_calibration(), *_growth()]
"""Every passage with a result."""
