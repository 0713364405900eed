"""The `torc` command, called as a user calls it."""

import pytest

from torc.cli.main import main


def run_torc(*arguments, capsys):
    """Exit code, stdout and stderr; never a traceback."""
    with pytest.raises(SystemExit) as exit_:
        main([str(a) for a in arguments])
    out, err = capsys.readouterr()
    assert "Traceback" not in err
    return exit_.value.code, out, err
