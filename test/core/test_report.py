from tf_tree_py.core import BufferCore, Pose, report

SECOND = 1_000_000_000


def buffer_of_a_robot():
    buffer = BufferCore()
    for tick in range(5):
        buffer.insert('odom', 'base', 10 * SECOND + tick * SECOND // 4, Pose(), authority='driver')
    buffer.insert('base', 'camera', 77, Pose(), authority='urdf', static=True)
    return buffer


def test_yaml_is_that_of_tf2():
    assert report.as_yaml(buffer_of_a_robot().edges()) == (
        'base: \n'
        "  parent: 'odom'\n"
        "  broadcaster: 'driver'\n"
        '  rate: 5.000\n'
        '  most_recent_transform: 11.000000\n'
        '  oldest_transform: 10.000000\n'
        '  buffer_length: 1.000\n'
        'camera: \n'
        "  parent: 'base'\n"
        "  broadcaster: 'urdf'\n"
        '  rate: 10000.000\n'
        '  most_recent_transform: 0.000000\n'
        '  oldest_transform: 0.000000\n'
        '  buffer_length: 0.000\n')


def test_yaml_of_nothing_is_an_empty_list():
    assert report.as_yaml([]) == '[]'
    assert report.as_yaml(BufferCore().edges()) == '[]'


def test_string_is_a_line_for_each_frame_with_a_parent():
    assert report.as_string(buffer_of_a_robot().edges()) == (
        'Frame base exists with parent odom.\n'
        'Frame camera exists with parent base.\n')
    assert report.as_string([]) == ''


def test_cleared_edge_is_not_reported():
    buffer = buffer_of_a_robot()
    buffer.clear()
    assert report.as_string(buffer.edges()) == 'Frame camera exists with parent base.\n'
