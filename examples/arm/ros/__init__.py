"""
The arm as three processes of ROS, and one without.

``hardware`` has PyBullet and no ROS, the others have ROS and no PyBullet: they need not be of
one Python. Between the two is a pipe, and ``wire`` says what goes through it.
"""
