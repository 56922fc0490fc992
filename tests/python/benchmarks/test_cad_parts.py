"""Views of real CAD parts: solids of a file are fused, a name decides the views, members are unpacked once."""

import shutil
import subprocess

import numpy as np
import pytest

pytest.importorskip("OCP", reason="OpenCascade is not installed: scripts/make-venv.sh dev,solids")

from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

from benchmarks.edges import cad_parts
from export.photos.packages import PackageError, load_packages
from export.solids import shapes as s
from export.solids.crops import WHOLE_PX, whole_views

NAME = "Relay.3dshapes/Small_Relay.step"


@pytest.fixture(scope="module")
def step(tmp_path_factory):
    """Two boxes, one standing on the other, each a solid of the file: 20 x 10 x 8 mm together."""
    path = tmp_path_factory.mktemp("step") / "part.step"
    writer = STEPControl_Writer()
    for box in (s.box((20, 10, 5)), s.box((8, 6, 3), (0, 0, 5))):
        writer.Transfer(box, STEPControl_AsIs)
    writer.Write(str(path))
    return path


def test_the_solids_of_a_file_become_one(step):
    part = cad_parts.read_step(step)
    assert s.volume(part) == pytest.approx(20 * 10 * 5 + 8 * 6 * 3)
    assert len(s.faces(part)) == 11  # where the boxes touch there is no face
    np.testing.assert_allclose(np.ptp(s.bounds(part), axis=0), (20, 10, 8), atol=1e-5)


def test_a_file_that_is_not_step_is_named_in_the_error(tmp_path):
    path = tmp_path / "bad.step"
    path.write_text("no STEP")
    with pytest.raises(s.ShapeError, match=r"bad\.step"):
        cad_parts.read_step(path)


def test_the_name_of_a_part_decides_its_views(step):
    first, again, other = (
        cad_parts.made_of(cad_parts.read_step(step), name) for name in (NAME, NAME, "Fuse.3dshapes/a.step")
    )
    assert (first.cameras[0].centre == again.cameras[0].centre).all()
    assert (first.cameras[0].centre != other.cameras[0].centre).all()
    assert first.family == "Relay"
    records = whole_views("kicad/000000", first)
    assert records == whole_views("kicad/000000", again)
    assert [(r.width, r.height) for r in records] == list(WHOLE_PX) * cad_parts.VIEWS
    assert all(r.seen_curves()["curves"] for r in records)
    assert all((r.decoded()["distance"] < 4).any() for r in records)


@pytest.mark.skipif(shutil.which("dpkg-deb") is None, reason="dpkg-deb is not installed, which reads .deb")
def test_members_are_unpacked_once_and_missing_ones_named(tmp_path):
    tree = tmp_path / "tree"
    inside = tree / "usr/share/kicad/3dmodels" / NAME
    inside.parent.mkdir(parents=True)
    inside.write_text("solid")
    (tree / "DEBIAN").mkdir()
    (tree / "DEBIAN/control").write_text(
        "Package: parts\nVersion: 1\nArchitecture: all\nMaintainer: a <a@b.c>\nDescription: parts\n"
    )
    archive = tmp_path / "parts.deb"
    subprocess.run(["dpkg-deb", "--root-owner-group", "--build", tree, archive], check=True, capture_output=True)
    (path,) = cad_parts.unpacked(archive, [NAME], tmp_path / "out")
    assert path.read_text() == "solid"
    archive.unlink()
    assert cad_parts.unpacked(archive, [NAME], tmp_path / "out") == [path]  # all is there: the archive is not needed
    subprocess.run(["dpkg-deb", "--root-owner-group", "--build", tree, archive], check=True, capture_output=True)
    with pytest.raises(PackageError, match=r"Fuse\.3dshapes/none\.step"):
        cad_parts.unpacked(archive, [NAME, "Fuse.3dshapes/none.step"], tmp_path / "out")


def test_the_list_has_each_part_once_and_one_a_category():
    names = cad_parts.part_names()
    assert len(names) >= 60
    assert len({name.split("/")[0] for name in names}) == len(names)
    assert set(load_packages(cad_parts.FOLDER / "packages.toml")) == {cad_parts.PACKAGE}
