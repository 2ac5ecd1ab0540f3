from PIL import Image

from tubefoot.records import Run
from tubefoot.report.kept import kept_pictures
from tubefoot.report.runs import load_run


def record(directory, verb, names):
    run = Run(directory, verb, {})
    run.finish()
    for name in names:
        run.path(name).parent.mkdir(exist_ok=True)
        Image.new("RGB", (4, 3)).save(run.path(name))
    return load_run(directory)


def test_pictures_of_other_verbs_have_anchors_of_their_own(tmp_path):
    first = record(tmp_path / "a b", "bend", ["bend.png", "figures/offsets.png"])
    second = record(tmp_path / "two", "grasp", ["bend.png", "pressure-angle.png"])
    (tmp_path / "two" / "bend.svg").write_text("<svg/>")
    pictures = kept_pictures([first, second], taken={"pressure-angle"})
    assert [picture.key for picture in pictures] == ["bend", "offsets", "bend-two", "pressure-angle-two"]
    assert pictures[0].svg is None
    assert pictures[2].svg == tmp_path / "two" / "bend.svg"
    assert pictures[1].caption == "Drawn by bend."


def test_the_third_of_a_name_is_numbered(tmp_path):
    run = record(tmp_path / "x", "bend", ["bend.png", "figures/bend.png", "pictures/bend.png"])
    assert [picture.key for picture in kept_pictures([run], taken=())] == ["bend", "bend-x", "bend-x-2"]
