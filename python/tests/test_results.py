"""Results: attributes, tables, axes, pictures."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

import tapjoint


def prop_attributes_are_the_keys_of_the_document(bar):
    result = tapjoint.identify(bar)
    document = result.to_dict()
    assert result.estimate.kr.value == document["estimate"]["kr"]["value"]
    assert result.estimate.to_dict() == document["estimate"]
    assert result.test.name == "Bar"
    assert "kr" in dir(result.estimate) and "estimate" in dir(result)
    assert result.gap is None
    with pytest.raises(AttributeError, match="there are"):
        result.nothing
    with pytest.raises(AttributeError, match="there are"):
        result.estimate.nothing
    assert "Kr" in str(result) and "Bar" in repr(result)
    with pytest.raises(tapjoint.InputError) as found:
        result.to_pandas("nothing")
    assert found.value.file is None and found.value.remedy.startswith("give one of modes, ")


def prop_results_sections_and_errors_are_copied_and_pickled(bar):
    result = tapjoint.identify(bar)
    estimate = result.estimate
    assert copy.deepcopy(estimate) == estimate
    assert copy.copy(result).to_dict() == copy.deepcopy(result).to_dict() == result.to_dict()
    assert pickle.loads(pickle.dumps(estimate)).kr.value == estimate.kr.value
    again = pickle.loads(pickle.dumps(result))
    assert again.to_dict() == result.to_dict() and str(again) == str(result)
    assert again._repr_html_().startswith("<pre>")
    with pytest.raises(tapjoint.InputError, match="process"):
        again.spectrum()
    for call in (lambda: tapjoint.identify(bar, frequencies=[17.0]), lambda: tapjoint.run("none.toml")):
        with pytest.raises(tapjoint.TapjointError) as found:
            call()
        error = pickle.loads(pickle.dumps(found.value))
        assert type(error) is type(found.value) and str(error) == str(found.value)
        assert error.file == found.value.file


def prop_tables_hold_the_numbers_of_the_document(cantilever):
    pytest.importorskip("pandas")
    result = tapjoint.run(cantilever / "test.toml")
    tables = result.to_pandas()
    names = ["modes", "parameters", "taps", "prediction", "perturbation", "hypotheses", "warnings"]
    assert sorted(tables) == sorted(names)
    assert list(tables["modes"]["frequency"]) == [mode.frequency for mode in result.modes]
    parameters = result.to_pandas("parameters").set_index("parameter")
    assert parameters.loc["kr", "value"] == result.estimate.kr.value
    assert parameters.loc["kr", "unit"] == "N m/rad"
    with pytest.raises(tapjoint.InputError, match="give one of modes, parameters, taps"):
        result.to_pandas("nothing")


def prop_axes_have_names_and_units(cantilever):
    pytest.importorskip("xarray")
    result = tapjoint.run(cantilever / "test.toml")
    data = result.to_xarray()
    assert data.frequency.dims == ("mode",) and data.frequency.attrs["units"] == "Hz"
    assert float(data.parameter_value.sel(parameter="kr")) == result.estimate.kr.value
    functions = result.frf(0).to_xarray()
    assert functions.h1.dims == ("response", "frequency")
    assert functions.h1.attrs["units"] == "(m/s2)/N"
    assert functions.coherence.attrs["units"] == "1"
    assert result.spectrum(0).to_xarray().force_spectrum.attrs["units"] == "N s"


def prop_arrays_of_a_result_are_those_of_its_recordings(cantilever):
    result = tapjoint.run(cantilever / "test.toml")
    functions = result.frf(0)
    assert functions.names == ("A", "B") and functions.form == "accelerance"
    assert functions.h1.shape == (2, 801) and functions.h1.dtype == np.complex128
    receptance = result.frf(0, form="receptance")
    omega = 2 * np.pi * functions.frequency[1:]
    assert np.allclose(receptance.h1[:, 1:] * -(omega**2), functions.h1[:, 1:])
    assert result.spectrum(1).response.shape == (2, 801)
    assert np.array_equal(copy.copy(result).frf(0).h1, functions.h1)
    assert np.array_equal(copy.deepcopy(result).frf(0).h1, functions.h1)
    for recording in (7, -1, 10**30, 0.5):
        with pytest.raises(tapjoint.InputError, match="recording"):
            result.frf(recording)
        with pytest.raises(tapjoint.InputError, match="recording"):
            result.spectrum(recording)
    with pytest.raises(tapjoint.InputError, match="form"):
        result.frf(0, form="compliance")


def recover_modes_of_every_form(cantilever):
    result = tapjoint.run(cantilever / "test.toml")
    expected = result.frf(0).modes().frequency
    for form in ("mobility", "receptance"):
        functions = result.frf(0, form=form)
        assert np.isnan(functions.h1[:, 0]).all()
        found = functions.modes().frequency
        # Each form weighs the lines in its own way.
        assert all(abs(found / one - 1).min() < 1e-3 for one in expected)
    functions.h1[:] = np.nan
    with pytest.raises(tapjoint.InputError, match="finite"):
        functions.modes()


def prop_a_notebook_shows_the_first_screen(cantilever):
    html = tapjoint.run(cantilever / "test.toml")._repr_html_()
    assert html.startswith("<iframe") and "Cantilever" in html
    assert "&lt;section class=&quot;answer&quot;" in html and "&lt;script" not in html


def prop_everything_can_be_drawn(cantilever, bar):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    result = tapjoint.run(cantilever / "test.toml")
    recording = tapjoint.read(cantilever / "low.wav")
    drawn = [
        result.plot(),
        result.frf(0).plot(),
        result.spectrum(0).plot(),
        result.frf(1).modes().plot(),
        recording.plot(),
        recording.measure(1).plot(),
        tapjoint.identify(bar).plot(),
    ]
    for axes in drawn:
        assert axes.get_xlabel() and axes.has_data()
        matplotlib.pyplot.close(axes.figure)


def limit_a_missing_package_is_named_with_its_remedy(bar, monkeypatch):
    import importlib

    real = importlib.import_module

    def without(name, *rest):
        if name.split(".")[0] in ("pandas", "xarray", "matplotlib"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return real(name, *rest)

    monkeypatch.setattr("tapjoint._packages.import_module", without)
    result = tapjoint.identify(bar)
    for name, call in (
        ("pandas", result.to_pandas),
        ("xarray", result.to_xarray),
        ("matplotlib", result.plot),
    ):
        with pytest.raises(tapjoint.MissingPackageError) as found:
            call()
        assert found.value.remedy == f'pip install "tapjoint[{name}]"'
        assert isinstance(found.value, ImportError)
