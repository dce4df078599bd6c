# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Program: tf2's client and ours look up the same with the running server; print JSON."""

from concurrent.futures import ThreadPoolExecutor
import json
import sys
import threading

from action_clients import close_race
from geometry_msgs.msg import TransformStamped
import rclpy
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future
from rclpy.time import Time
import tf2_ros
import tf_tree_py
from two_buffers import answer

PATIENCE = Duration(seconds=30)
ACTION = 'tf2_buffer_server'
SPAN = range(100, 110)


def transform(parent, child, seconds, x):
    """Return a transform with a translation along x."""
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    message.header.stamp = Time(seconds=seconds).to_msg()
    message.transform.translation.x = x
    return message


def questions():
    """Yield the lookups of existing data, for both clients."""
    for target, source in (('map', 'base'), ('base', 'map'), ('map', 'camera'), ('camera', 'map'),
                           ('map', 'nowhere'), ('map', 'palm'), ('', 'base')):
        for time in (Time(), Time(nanoseconds=104_500_000_000), Time(seconds=104),
                     Time(seconds=999), Time(seconds=1)):
            yield 'lookup_transform', target, source, time
        yield ('lookup_transform_full', target, Time(seconds=102), source, Time(seconds=104),
               'map')


def tell(node):
    """Publish a moving robot, and an island; return a function that moves the robot."""
    fixed = tf_tree_py.StaticTransformBroadcaster(node)
    fixed.sendTransform([transform('base', 'camera', 0, 0.5), transform('island', 'palm', 0, 1.0)])
    moving = tf_tree_py.TransformBroadcaster(node)
    while not moving.pub_tf.get_subscription_count():
        threading.Event().wait(0.01)
    return lambda seconds: moving.sendTransform(transform('map', 'base', seconds, float(seconds)))


def ask(clients, move):
    """Return both clients' results for existing data, for later data, and for missing data."""
    found = [{'question': [str(word) for word in question],
              **{name: answer(client, *question) for name, client in clients.items()}}
             for question in questions()]
    after = 'lookup_transform', 'map', 'base', Time(seconds=SPAN[-1] + 1), PATIENCE
    with ThreadPoolExecutor() as threads:
        waiting = {name: threads.submit(answer, client, *after)
                   for name, client in clients.items()}
        # By then the server has most likely received both goals.
        answer(clients['ours'], 'lookup_transform', 'map', 'base', Time())
        move(SPAN[-1] + 1)
        waited = {name: future.result() for name, future in waiting.items()}
    never = 'lookup_transform', 'map', 'base', Time(seconds=999), Duration(nanoseconds=200_000_000)
    return {'found': found, 'waited': waited,
            'never': {name: answer(client, *never) for name, client in clients.items()}}


def main():
    rclpy.init()
    asking, telling = rclpy.create_node('asking'), rclpy.create_node('telling')
    executor, done = SingleThreadedExecutor(), Future()
    executor.add_node(asking)
    # A program of tf2 spins its client's node itself.
    spinning = threading.Thread(target=executor.spin_until_future_complete, args=(done,))
    spinning.start()
    theirs = tf2_ros.BufferClient(asking, ACTION)
    close_race(theirs.action_client)
    with tf_tree_py.BufferClient(asking, ACTION) as ours:
        if not (theirs.action_client.wait_for_server(30.0) and ours.wait_for_server(PATIENCE)):
            sys.exit('no buffer server is available')
        move = tell(telling)
        for seconds in SPAN:
            move(seconds)
        # Until the server has received everything.
        ours.lookup_transform('island', 'palm', Time(), PATIENCE)
        ours.lookup_transform('map', 'camera', Time(seconds=SPAN[-1]), PATIENCE)
        print(json.dumps(ask({'theirs': theirs, 'ours': ours}, move)), flush=True)
    done.set_result(None)
    executor.wake()
    spinning.join()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
