"""The package as a whole: names, laziness, the command."""

from __future__ import annotations

import subprocess
import sys

import pytest

import tapjoint


def prop_every_public_name_exists_and_has_a_docstring():
    for name in tapjoint.__all__:
        value = getattr(tapjoint, name)
        assert name.startswith("__") or value.__doc__, name
    assert set(tapjoint.__all__) <= set(dir(tapjoint))
    with pytest.raises(AttributeError):
        tapjoint.nothing


def limit_packages_are_loaded_when_they_are_used():
    code = (
        "import sys, tapjoint\n"
        "assert 'numpy' not in sys.modules\n"
        "tapjoint.frf, tapjoint.read, tapjoint.run, tapjoint.Test, tapjoint.batch\n"
        "heavy = {'pandas', 'xarray', 'matplotlib', 'scipy', 'dask', 'distributed'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def regress_the_module_of_errors_is_there_after_an_import():
    code = "import tapjoint; assert issubclass(tapjoint.errors.InputError, tapjoint.TapjointError)"
    subprocess.run([sys.executable, "-c", code], check=True)


def prop_the_command_has_the_exit_codes_of_the_program(tmp_path):
    def code(*arguments: str) -> int:
        line = [sys.executable, "-m", "tapjoint._cli", *arguments]
        return subprocess.run(line, capture_output=True).returncode

    assert code("--version") == 0
    assert code("predict", "--joint", "free") == 0
    assert code("nothing") == 2
    assert code("run", str(tmp_path / "none.toml")) == 2
