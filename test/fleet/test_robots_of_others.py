"""Robots that run a bridge or rmw_zenoh are understood, as their documents say what they send."""

from fleet_helpers import message, until, Visits, x_of
from tf_tree_py.fleet import FleetListener
from tf_tree_py.fleet.keys import key_of, rmw_key_of, Topic


def test_a_bridge_is_understood_and_its_robot_appears_with_its_data(listen, session, hall):
    visits = Visits()
    listener = listen(on_robot=visits)
    until(lambda: listener.connected)
    for static in (True, False):
        edge = ('base', 'fork', 2) if static else ('map', 'base', 1)
        until(lambda static=static, edge=edge: session.put(
            key_of(Topic('robot7', static), hall), message(edge)) or any(
                info.static == static for info in listener.buffer.edges()))
    assert x_of(listener.buffer, 'map', 'robot7/fork') == 3.0
    assert visits.wait() == ('robot7', True)
    assert listener.robots()[0].here


def test_a_bridges_robot_goes_with_its_tokens(listen, session, hall):
    visits = Visits()
    listen(on_robot=visits)
    token = session.liveliness().declare_token(
        f'@/{session.zid()}/@ros2_lv/MP/{hall}§robot7§tf/tf2_msgs§msg§TFMessage/:::')
    assert visits.wait() == ('robot7', True)
    token.undeclare()
    assert visits.wait() == ('robot7', False)


def test_rmw_zenoh_is_understood(listen, session, hall):
    visits = Visits()
    listener = listen(on_robot=visits)
    topic = f'%{hall}%robot7%tf_static'
    token = session.liveliness().declare_token(
        f'@ros2_lv/0/{session.zid()}/0/10/MP/%/%{hall}%robot7/driver/{topic}/'
        'tf2_msgs::msg::dds_::TFMessage_/RIHS01_e369d0f05a23ae/::,100:,:,:,,')
    assert visits.wait() == ('robot7', True)
    moving = rmw_key_of(Topic('robot7', False), 0, key_prefix=hall)
    until(lambda: session.put(moving, message(('map', 'base', 5))) or listener.buffer.frames())
    assert x_of(listener.buffer, 'map', 'robot7/base') == 5.0
    token.undeclare()
    assert visits.wait() == ('robot7', False)


def test_robots_without_a_namespace_are_called_by_their_domain(router, session):
    with FleetListener(router, 'domain*') as listener:
        key = rmw_key_of(Topic('', False), 73)
        until(lambda: session.put(key, message(('map', 'base', 5))) or listener.buffer.frames())
        assert x_of(listener.buffer, 'map', 'domain73/base') == 5.0
