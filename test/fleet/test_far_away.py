# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A robot and a desk with a poor link: 100 ms, 2 % of all packets lost, then interrupted."""

from contextlib import closing
import json
import math
import time

from conditions import until
from hosts import two_apart
from poor_link import PoorLink
from programs import PATIENCE_S
import pytest

GAP_S = 3.0
RATE_HZ = 20
PORT = 7447
# By default, Zenoh gives a connection up after ten seconds of silence. With this setting of both
# sides, the gap is long enough for that.
IMPATIENT = 'transport: {link: {tx: {lease: 1000}}}'
# The position of the robot as a function of the stamp, used by the robot and here.
PLACE = 'math.sin(stamp * 1e-9)'

ROBOT = f"""
    import json
    import math
    import os
    import sys
    import threading
    import time
    from tf_tree_py.core import Pose, Sample
    from tf_tree_py.thinning import StaticSender
    from tf_tree_py.fleet.connection import Uplink

    uplink = Uplink('tcp/10.0.0.2:{PORT}', 'robot7', history=400,
                    config=os.environ['ZENOH_FILE'])
    static, ended, stamps = StaticSender(uplink.send_static), threading.Event(), []

    def drive():
        while not ended.wait(1 / {RATE_HZ}):
            stamp = time.time_ns()
            uplink.send([Sample('map', 'base', stamp, Pose(x={PLACE}))])
            stamps.append(stamp)

    driving = threading.Thread(target=drive)
    driving.start()
    print('drives', flush=True)
    # Each line is the name of a sensor to mount, or empty: print the stamps of all samples that
    # were sent.
    for line in sys.stdin:
        if line.strip():
            static.offer([Sample('base', line.strip(), 0, Pose(x=2.0))])
        print(json.dumps(stamps), flush=True)
    ended.set()
    driving.join()
    uplink.close()
"""

DESK = f"""
    import json
    import sys
    import time
    from tf_tree_py.core import LATEST, TransformException
    from tf_tree_py.fleet import FleetListener
    import zenoh

    router = zenoh.open(zenoh.Config.from_json5('''{{
        mode: "router", listen: {{endpoints: ["tcp/0.0.0.0:{PORT}"]}},
        scouting: {{multicast: {{enabled: false}}}}, timestamping: {{enabled: true}},
        {IMPATIENT}}}'''))
    with FleetListener('tcp/127.0.0.1:{PORT}', cache_time=60 * 10**9) as listener:
        print('listens', flush=True)
        # Each line asks where a frame is at a stamp, and how long to wait for the answer. An
        # empty line asks for the stamps of all samples that were received.
        for line in sys.stdin:
            if not line.strip():
                print(listener.buffer.stamps_of('robot7/base').tolist(), flush=True)
                continue
            frame, stamp, timeout_s = json.loads(line)
            begin = time.monotonic()
            try:
                answer = listener.buffer.lookup_within(timeout_s, 'map', 'robot7/' + frame,
                                                       LATEST if stamp is None else stamp).x
            except TransformException as error:
                answer = type(error).__name__
            print(json.dumps([answer, time.monotonic() - begin]), flush=True)
    router.close()
"""


@pytest.fixture
def hosts():
    """Return a robot and a desk, and the link between them."""
    with two_apart() as (robot, desk), closing(
            PoorLink((robot, desk), delay_s=0.05, loss=0.02)) as link:
        yield robot, desk, link
        # While the link still carries packets.
        robot.end()
        desk.end()


def test_after_a_gap_nothing_is_missing_and_the_newest_statics_are_there(hosts, tmp_path):
    robot, desk, link = hosts
    (tmp_path / 'robot.json5').write_text(f'{{{IMPATIENT}}}')
    desk.run(DESK)
    robot.run(ROBOT, ZENOH_FILE=str(tmp_path / 'robot.json5'))

    def where_is(frame, stamp=None, timeout_s=PATIENCE_S):
        """Return the desk's result for a frame, and the seconds that it took; None: the latest."""
        return json.loads(desk.tell(json.dumps([frame, stamp, timeout_s])))

    def sent():
        return json.loads(robot.tell(''))

    def assert_right(stamp):
        assert where_is('base', stamp)[0] == pytest.approx(math.sin(stamp * 1e-9), abs=1e-9)

    robot.tell('camera')
    assert isinstance(where_is('camera')[0], float)
    before = sent()[-1]
    assert_right(before)
    link.carries = False
    robot.tell('lidar')
    assert where_is('base', time.time_ns() + 10**9, GAP_S)[0] == 'FutureExtrapolationException'
    assert where_is('lidar', timeout_s=0.0)[0] == 'LookupException'
    assert_right(before)
    link.carries = True
    place, waited_s = where_is('lidar')
    assert isinstance(place, float)
    print(f'after {GAP_S:g} s without a link the newest static transform came in {waited_s:.1f} s')
    # The robot stored its messages meanwhile.
    meanwhile = {stamp for stamp in sent() if stamp >= before}
    assert len(meanwhile) > GAP_S
    until(lambda: meanwhile <= set(json.loads(desk.tell(''))))
    for stamp in meanwhile:
        assert_right(stamp)
