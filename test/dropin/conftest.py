"""The fixtures of the ROS layer's tests, which also set the domain of this process."""

from ros.conftest import (  # noqa: F401
    context,
    listen,
    make_node,
    no_thread_is_left,
    node,
    pool,
    sim_clock,
    spin,
    talker,
)
