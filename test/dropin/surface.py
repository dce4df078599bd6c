# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Print as JSON the Python interface of tf2's packages: names, parameters, attributes.

A program, run with the real packages and with ours in their place. The second run receives the
names, because our packages load a name when it is used, and do not list all of them.
"""

import importlib
import inspect
import json
import sys

import rclpy
from rclpy.node import Node

MODULES = (
    'tf2_py', 'tf2_ros', 'tf2_ros.buffer', 'tf2_ros.buffer_client', 'tf2_ros.buffer_interface',
    'tf2_ros.static_transform_broadcaster', 'tf2_ros.transform_broadcaster',
    'tf2_ros.transform_listener', 'tf2_geometry_msgs', 'tf2_geometry_msgs.tf2_geometry_msgs',
    'tf2_sensor_msgs', 'tf2_sensor_msgs.tf2_sensor_msgs')


def public(names):
    return sorted(name for name in names if not name.startswith('_'))


def surface_of(module, names=None):
    """Return the given names of a module, or all that it lists."""
    return {name: described(getattr(module, name))
            for name in names or public(dir(module)) if hasattr(module, name)}


def described(thing):
    home = thing.__name__ if inspect.ismodule(thing) else getattr(thing, '__module__', None)
    answer = {'home': home or type(thing).__module__, 'parameters': parameters(thing)}
    if inspect.isclass(thing):
        answer['members'] = {name: parameters(getattr(thing, name))
                             for name in public(dir(thing))}
    return answer


def parameters(thing):
    """Return name, kind and default of each parameter; None if Python cannot determine them."""
    try:
        signature = inspect.signature(thing)
    except (TypeError, ValueError):
        return None
    return [[parameter.name, parameter.kind.name, default_of(parameter)]
            for parameter in signature.parameters.values()]


def default_of(parameter):
    value = parameter.default
    return 'required' if value is parameter.empty else str(getattr(value, 'nanoseconds', value))


def attributes_of(package):
    """Return the public attributes of an instance of each class, without methods."""
    rclpy.init()
    node = Node('surface')
    buffer = package.Buffer(node=node)
    listener = package.TransformListener(buffer, node)
    client = package.BufferClient(node, 'nobody')
    instances = [buffer, listener, client, package.TransformBroadcaster(node),
                 package.StaticTransformBroadcaster(node), package.BufferInterface(),
                 package.TypeException('no'), package.NotImplementedException()]
    names = {type(instance).__name__: public(
        name for name in dir(instance)
        if hasattr(instance, name) and not callable(getattr(type(instance), name, None)))
        for instance in instances}
    client.destroy()
    listener.unregister()
    node.destroy_node()
    rclpy.shutdown()
    return names


def main():
    """Read the package with the classes, and the names of each module if they are known."""
    package = importlib.import_module(sys.argv[1])
    wanted = json.loads(sys.stdin.read() or '{}')
    print(json.dumps({
        'modules': {name: surface_of(importlib.import_module(name), wanted.get(name))
                    for name in MODULES},
        'package': surface_of(package),
        'attributes': attributes_of(package)}))


if __name__ == '__main__':
    main()
