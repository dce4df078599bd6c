import pytest

pytest.importorskip('rosbags')
