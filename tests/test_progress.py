"""Progress from Python."""

import fluorspar


def test_true_draws_a_bar_that_comes_to_its_end(capsys):
    fluorspar.render("cornell-box", size=(8, 8), spp=4, wavelengths="400:700:100", progress=True)
    said = capsys.readouterr()
    assert "100%" in said.err
    assert said.out == ""


def test_nothing_is_drawn_without_being_asked(capsys):
    fluorspar.render("cornell-box", size=(8, 8), spp=4, wavelengths="400:700:100")
    assert capsys.readouterr() == ("", "")
