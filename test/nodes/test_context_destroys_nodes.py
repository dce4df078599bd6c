# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
From Kilted on, a context that is shut down destroys its nodes while it holds its lock.

A node that waits for a thread in its destruction must therefore not wait for one that needs the
lock. Nodes whose constructor raised are also destroyed.
"""

import sys
import textwrap

from programs import completed
import pytest

LISTENERS = """
    class Closing(Node):
        def __init__(self, number):
            super().__init__(f'closing_{number}')
            self.buffer = Buffer(node=self)
            self.closing = [TransformListener(self.buffer, self),
                            CovarianceListener(self.buffer, self)]

        def destroy_node(self):
            for each in self.closing:
                each.close()
            super().destroy_node()

    nodes = [Closing(number) for number in range(5)]
"""
TF2_PROGRAM = """
    import tf_tree_py.dropin
    tf_tree_py.dropin.install(force=True)
    from tf2_ros import Buffer, TransformListener

    class Program(Node):
        def __init__(self, number):
            super().__init__(f'program_{number}')
            self.buffer = Buffer()
            self.listener = TransformListener(self.buffer, self)

        def destroy_node(self):
            self.listener.unregister()
            super().destroy_node()

    nodes = [Program(number) for number in range(5)]
"""
EXECUTABLES = """
    from tf_tree_py.nodes.buffer_server import BufferServerNode
    from tf_tree_py.nodes.five_frame_listener import FiveFrameListener
    from tf_tree_py.nodes.relocalisation_anchor import RelocalisationAnchor
    from tf_tree_py.nodes.tf_relay import TfRelay
    from tf_tree_py.nodes.tf_share import TfShare

    nodes = [BufferServerNode(), TfRelay(namespace='/robot1'), RelocalisationAnchor(),
             FiveFrameListener(), TfShare()]
"""
CLIENTS = """
    nodes = [rclpy.create_node(f'asking_{number}') for number in range(3)]
    clients = [BufferClient(node, 'tf2_buffer_server') for node in nodes]
    for node, client in zip(nodes, clients):
        # As a program closes what it has when its node is destroyed.
        node.destroy_node = lambda node=node, client=client: (
            client.destroy(), type(node).destroy_node(node))
"""
HALF_MADE = """
    import gc
    from rclpy.parameter import Parameter
    from tf_tree_py.nodes.bad_input import BadInput
    from tf_tree_py.nodes.buffer_server import BufferServerNode
    from tf_tree_py.nodes.edge_switch import EdgeSwitch
    from tf_tree_py.nodes.five_frame_listener import FiveFrameListener
    from tf_tree_py.nodes.relocalisation_anchor import RelocalisationAnchor
    from tf_tree_py.nodes.tf_relay import TfRelay
    from tf_tree_py.nodes.urdf_broadcaster import UrdfBroadcaster

    errors = []
    for kind, name in ((EdgeSwitch, 'sources'), (BufferServerNode, 'buffer_size'),
                       (FiveFrameListener, 'rate_hz'), (RelocalisationAnchor, 'map_frame'),
                       (TfRelay, 'tf_topic'), (UrdfBroadcaster, 'publish_frequency')):
        try:
            kind(parameter_overrides=[Parameter(name, value=[True])])
        except BadInput as error:
            errors.append(error)  # whose traceback holds the node
    assert len(errors) == 6, errors
"""


@pytest.mark.parametrize('how', ['rclpy.shutdown()', 'rclpy.try_shutdown()'])
@pytest.mark.parametrize('made', [LISTENERS, TF2_PROGRAM, EXECUTABLES, CLIENTS, HALF_MADE], ids=[
    'listeners', 'tf2 program', 'executables', 'clients', 'half-made nodes'])
def test_shutdown_ends_with_every_node_alive(made, how):
    program = textwrap.dedent("""
        import rclpy
        from rclpy.node import Node
        from tf_tree_py import Buffer, BufferClient, CovarianceListener, TransformListener
        rclpy.init(args=[])
    """) + textwrap.dedent(made) + f'\n{how}\nprint("ended")\n'
    done = completed(sys.executable, '-c', program)
    assert (done.returncode, done.stdout) == (0, 'ended\n'), done.stderr
    assert 'Traceback' not in done.stderr
