"""A bundle's manifest names the sources of photographs that its weights were trained on."""

import pytest

from export.data_sources import CREDITS, credited_sources

HEADER = "id\tlicence\tsource\tcredit\n"


def test_the_sources_of_a_pack_are_named_once_with_all_their_licences(tmp_path):
    path = tmp_path / "credits.tsv"
    rows = ["a\tMIT\tsome/clips@12\tA\n", "b\tCC-BY-4.0\tsome/book@34\tB\u2028C\n", "c\tCC-BY-2.0\tsome/book@56\tD\n"]
    path.write_text(HEADER + "".join(rows), encoding="utf-8")
    found = [source.used_for("training") for source in credited_sources(path)]
    assert [(entry["licence"], entry["used_for"]) for entry in found] == [
        ("CC-BY-2.0, CC-BY-4.0", "training"), ("MIT", "training"),
    ]  # fmt: skip
    assert found[0]["name"] == f"photographs of people of some/book, credited in {CREDITS}"


@pytest.mark.parametrize("text", ["", "id\tlicence\n", HEADER + "a\tMIT\n"])
def test_another_file_is_refused(tmp_path, text):
    path = tmp_path / "credits.tsv"
    path.write_text(text)
    with pytest.raises(ValueError, match="is not a file of credits"):
        credited_sources(path)
