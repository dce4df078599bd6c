# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Sessions have safe defaults, and report errors in one sentence."""

import json
import subprocess
import sys

from programs import PATIENCE_S
import pytest
from tf_tree_py.fleet import configuration, FleetError, open_session

NOBODY_THERE = 'tcp/127.0.0.1:9'


def test_a_session_is_a_client_that_is_found_by_nobody():
    made = configuration('tcp/hall:7447')
    assert made.get_json('mode') == '"client"'
    assert made.get_json('connect/endpoints') == '["tcp/hall:7447"]'
    assert made.get_json('scouting/multicast/enabled') == 'false'
    assert made.get_json('transport/shared_memory/enabled') == 'false'
    assert '[::]' not in made.get_json('listen/endpoints')


def test_a_lost_router_is_searched_for_once_a_second(tmp_path):
    retry = json.loads(configuration('tcp/hall:7447').get_json('connect/retry'))
    assert (retry['period_init_ms'], retry['period_max_ms']) == (500, 1000)
    path = tmp_path / 'slow.json5'
    path.write_text('{connect: {retry: {period_max_ms: 9000}}}')
    made = configuration('tcp/hall:7447', path)
    assert json.loads(made.get_json('connect/retry'))['period_max_ms'] == 9000


def test_an_attempt_to_connect_takes_two_seconds_at_most(tmp_path):
    key, path = 'transport/unicast/open_timeout', tmp_path / 'patient.json5'
    path.write_text('{transport: {unicast: {open_timeout: 7000}}}')
    assert configuration('tcp/hall:7447').get_json(key) == '2000'
    assert configuration('tcp/hall:7447', path).get_json(key) == '7000'


def test_a_file_may_say_more_and_is_otherwise_filled_carefully(tmp_path):
    path = tmp_path / 'peer.json5'
    path.write_text('{ mode: "peer", // a comment\n connect: { endpoints: ["tcp/hall:7447"] } }')
    made = configuration(config=path)
    assert made.get_json('mode') == '"peer"'
    assert made.get_json('connect/endpoints') == '["tcp/hall:7447"]'
    assert '"peer":["tcp/127.0.0.1:0"]' in made.get_json('listen/endpoints')
    path.write_text('{ mode: "peer", listen: { endpoints: ["tcp/0.0.0.0:7000"] } }')
    assert '0.0.0.0:7000' in configuration('tcp/hall:7447', path).get_json('listen/endpoints')


@pytest.mark.parametrize('address', ['hall', 'tcp/hall', 'tls/hall', 'tcp/:7447', '', 'tcp/h:x'])
def test_what_is_no_address_is_named(address):
    with pytest.raises(FleetError, match='tcp/hall:7447'):
        configuration(address)


def test_no_address_at_all_is_an_error():
    with pytest.raises(FleetError, match='nothing to connect to'):
        configuration()


@pytest.mark.parametrize('text', ['{ mode: }', '{ modee: "client" }', '\0'])
def test_a_file_that_is_no_configuration_is_named(tmp_path, text):
    path = tmp_path / 'bad.json5'
    path.write_text(text)
    with pytest.raises(FleetError, match='bad.json5 is not a Zenoh configuration') as raised:
        configuration('tcp/hall:7447', path)
    assert '\n' not in str(raised.value) and '.rs' not in str(raised.value)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(FleetError, match='there is no such configuration file'):
        configuration('tcp/hall:7447', tmp_path / 'none.json5')


def test_nobody_there_is_an_error_in_time():
    with pytest.raises(FleetError, match='Unable to connect'):
        open_session(configuration(NOBODY_THERE), timeout_s=0.1)


def test_without_zenoh_the_layer_imports_and_says_what_to_install():
    program = """
import sys
sys.modules['zenoh'] = None
from tf_tree_py.fleet import configuration, FleetError
try:
    configuration('tcp/hall:7447')
except FleetError as error:
    print(error)
"""
    result = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                            timeout=PATIENCE_S, check=True)
    assert result.stdout == ('a fleet needs eclipse-zenoh, which is not installed: '
                             'pip install eclipse-zenoh\n')
