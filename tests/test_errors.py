from drkid.errors import DrkidError, InputError


def test_an_error_says_all_four_things():
    error = InputError("a.tif cannot be read", wanted="a TIFF", found="0 bytes", remedy="export it again")
    assert str(error) == "a.tif cannot be read; wanted: a TIFF; found: 0 bytes; try: export it again"
    assert error.exit_status == 2


def test_what_is_not_known_is_left_out():
    assert str(DrkidError("no")) == "no"
