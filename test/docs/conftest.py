"""What runs here runs on this machine alone, on a domain of this process alone."""

import os

os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
os.environ['ROS_DOMAIN_ID'] = str(101 + os.getpid() % 100)
