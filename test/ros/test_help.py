"""What ``help(Buffer)`` shows is for those who use one."""

from tf_tree_py import Buffer

FOR_THE_PACKAGE = {
    'begin_feed', 'end_feed', 'fed_by',
    'log_to', 'name_later', 'no_longer_fed_by', 'note', 'record',
    'refuse'}


def test_what_only_the_package_calls_is_not_public():
    public = {name for name in dir(Buffer) if not name.startswith('_')}
    assert public & FOR_THE_PACKAGE == set()
    assert {f'_{name}' for name in FOR_THE_PACKAGE} <= set(dir(Buffer))


def test_whatever_is_public_says_what_it_does():
    undocumented = [name for name in dir(Buffer) if not name.startswith('_')
                    and not (getattr(Buffer, name).__doc__ or '').strip()]
    assert undocumented == []
