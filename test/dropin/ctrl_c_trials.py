# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Interrupts a node that only listens at many moments, and counts how it ends (docs/ending.md).

    python test/dropin/ctrl_c_trials.py 500         # as many runs; busy programs beside it help
    python test/dropin/ctrl_c_trials.py 500 tf2     # with the installed tf2_ros

It is no test, because one end in a thousand is a crash of rclpy.
"""

from collections import Counter
import random
import signal
import subprocess
import sys
import time

_RATE_HZ = 170.0
_LONGEST_S = 0.8

PUBLISHES = f"""
import rclpy
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

rclpy.init()
node = rclpy.create_node('publishes')
publisher = node.create_publisher(TFMessage, '/tf', 100)

def publish():
    edge = TransformStamped(child_frame_id='base')
    edge.header.frame_id, edge.header.stamp = 'map', node.get_clock().now().to_msg()
    edge.transform.rotation.w = 1.0
    publisher.publish(TFMessage(transforms=[edge]))

node.create_timer(1.0 / {_RATE_HZ}, publish)
rclpy.spin(node)
"""

LISTENS = """
import rclpy
from tf2_ros import Buffer, TransformListener

rclpy.init()
node = rclpy.create_node('listens')
buffer = Buffer()
listener = TransformListener(buffer, node)
try:
    print('ready', flush=True)
    rclpy.spin(node)
except KeyboardInterrupt:
    pass
finally:
    node.destroy_node()
    rclpy.try_shutdown()
"""

DROP_IN = 'import tf_tree_py.dropin\ntf_tree_py.dropin.install(force=True)\n'


def ends(count: int, program: str) -> Counter[tuple[int, str]]:
    """Return how often each exit status and last line of standard error was seen."""
    moments = random.Random(count)
    found: Counter[tuple[int, str]] = Counter()
    for _ in range(count):
        with subprocess.Popen(
                [sys.executable, '-X', 'faulthandler', '-c', program], text=True,
                stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            assert process.stdout is not None
            process.stdout.readline()
            time.sleep(moments.uniform(0.0, _LONGEST_S))  # the moment of the signal is the subject
            process.send_signal(signal.SIGINT)
            errors = process.communicate()[1].splitlines()
            found[process.returncode, errors[-1] if errors else ''] += 1
    return found


def main(count: int, with_tf2: bool) -> None:
    """Print how many of the runs ended in which way."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # the shell may have it ignored
    with subprocess.Popen([sys.executable, '-c', PUBLISHES]) as publisher:
        try:
            for (status, line), times in ends(
                    count, LISTENS if with_tf2 else DROP_IN + LISTENS).most_common():
                print(f'{times} x exit status {status} {line}')
        finally:
            publisher.kill()


if __name__ == '__main__':
    main(int(sys.argv[1]), sys.argv[2:] == ['tf2'])
