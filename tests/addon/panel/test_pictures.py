# SPDX-License-Identifier: Apache-2.0
"""Pictures of every shape fill the squares that Blender draws them into, the sidebar's width, and bear their names."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from .. import fake_backend
from ..test_operators import fit
from .laid_out import AROUND, Item, Layout, Picture

WIDTHS = (220, 280, 400)  # of the sidebar, pixels at a scale of 1
SHAPES = ((1920, 1080), (256, 256), (1080, 1920), (1440, 1080), (2390, 1000))
LEAST = 0.7  # of a square: of one wide picture alone 0.56 is picture
COMPARED = (("reference", "result", "start"), ("reference", "current", "difference"), ("cycles", "engine", "reference"))


class Collection(dict[str, Any]):
    """Stands for Blender's previews, which a Blender in the background has not; the number of an icon is its place."""

    def new(self, key: str) -> SimpleNamespace:
        pixels = SimpleNamespace(foreach_set=lambda values: setattr(self[key], "pixels", values.view(np.uint8)))
        self[key] = SimpleNamespace(icon_id=len(self) + 1, image_size=(0, 0), image_pixels=pixels)
        return self[key]

    def filled(self, number: int) -> float:
        """How much of the square of an icon is picture."""
        made = next(each for each in self.values() if each.icon_id == number)
        return float((made.pixels.reshape(-1, 4)[:, 3] == 255).sum()) / max(made.image_size) ** 2


@pytest.fixture
def icons(addon: object, monkeypatch: pytest.MonkeyPatch) -> Collection:
    from blender_addon.pictures import previews

    found = Collection()
    monkeypatch.setattr(previews, "_collection", found)
    monkeypatch.setattr(previews, "bpy", SimpleNamespace(app=SimpleNamespace(background=False)))
    for kept in ("_shown", "_thumbnails"):
        monkeypatch.setattr(previews, kept, {})
    return found


def shown(names: tuple[str, ...], folder: Path, size: tuple[int, int]) -> None:
    """As after a fit of pictures of this size."""
    from blender_addon.pictures import previews

    side = max(size) // 96  # fewer pixels do
    for i, name in enumerate(names):
        fake_backend.thumbnail(folder, name, (40 * i, 60, 200), (size[0] // side, size[1] // side))
        previews.show(name, folder)


def drawn(names: tuple[str, ...], width: float, scale: float, **options: Any) -> Layout:
    import bpy

    from blender_addon.panel.layout import draw_pictures

    context = SimpleNamespace(
        region=SimpleNamespace(width=width * scale),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=scale), addons=bpy.context.preferences.addons),
    )
    layout = Layout(_untranslated())
    draw_pictures(layout, context, names, **options)  # type: ignore[arg-type]  # stands for Blender's
    return layout


@pytest.mark.parametrize("size", SHAPES, ids=lambda size: f"{size[0]}x{size[1]}")
@pytest.mark.parametrize("names", COMPARED, ids="_".join)
@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_squares_are_filled(
    icons: Collection, tmp_path: Path, size: tuple[int, int], names: tuple[str, ...], width: int, scale: float
) -> None:
    shown(names, tmp_path, size)
    layout = drawn(names, width, scale)
    placed = list(layout.pictures(width - AROUND))
    assert placed
    for picture, share in placed:
        assert picture.icon > 0
        assert icons.filled(picture.icon) >= LEAST
        assert 0.8 * min(share, 300.0) <= picture.side <= max(share, 40.0)  # as wide as its place
    assert sum(share for _, share in placed) >= 0.95 * (width - AROUND)


@pytest.mark.parametrize("clickable", [True, False])
def test_each_picture_has_its_name_beside_it(icons: Collection, tmp_path: Path, clickable: bool) -> None:
    names = COMPARED[0]
    (tmp_path / "wide").mkdir()
    shown(names, tmp_path / "wide", (1920, 1080))
    texts = list(_texts(drawn(names, 280, 1.0, clickable=clickable)))
    assert texts == ["Reference", "a picture", "Result", *(["Start"] if clickable else [])]  # from above
    (tmp_path / "tall").mkdir()
    shown(names, tmp_path / "tall", (1080, 1920))
    texts = list(_texts(drawn(names, 280, 1.0, clickable=clickable)))
    assert texts == ["a picture", "Reference", "Result", *(["Start"] if clickable else [])]  # from the left


def _untranslated() -> Any:
    def words(text: str, _context: str) -> str:
        return text

    words.measure = lambda text: 6.0 * len(text)  # type: ignore[attr-defined]
    return words


def _texts(layout: Layout) -> Any:
    for item in layout.items:
        if isinstance(item, Layout):
            yield from _texts(item)
        elif isinstance(item, Picture):
            yield "a picture"
        elif isinstance(item, Item):
            yield from item.texts


@pytest.mark.parametrize(("size", "axis"), [((1920, 1080), 0), ((1080, 1920), 1)])
def test_the_first_is_above_or_left(size: tuple[int, int], axis: int) -> None:
    from blender_addon.pictures.thumbnail import is_wide, paired

    first, second = (np.full((size[1] // 4, size[0] // 4, 3), value, np.uint8) for value in (10, 200))
    both = paired(first, second)
    assert both is not None
    half = first.shape[axis]
    assert (np.take(both, range(half), axis)[..., :3] == 10).all()
    assert (np.take(both, range(-half, 0), axis)[..., :3] == 200).all()
    assert is_wide(first) == (axis == 0)
    assert paired(first, second[:-1]) is None  # of two sizes


def test_what_is_drawn_is_upright(icons: Collection, tmp_path: Path) -> None:
    """Blender has the lowest row first, a file the uppermost."""
    from blender_addon.pictures import previews

    rows = bytes((255, 0, 0)) * 4 + bytes((0, 0, 255)) * 4
    (tmp_path / "flag.ppm").write_bytes(b"P6 4 2 255\n" + rows)
    previews.show_thumbnail("flag", tmp_path / "flag.ppm")
    (made,) = icons.values()
    assert made.image_size == (4, 2)
    assert made.pixels.reshape(2, 4, 4)[:, 0].tolist() == [[0, 0, 255, 255], [255, 0, 0, 255]]


@pytest.mark.parametrize(
    "content",
    [b"", b"P5 2 2 255\n" + bytes(12), b"P6 2 2 255\n" + bytes(11), b"P6 0 0 255\n", b"P6 2 2 65535\n" + bytes(24)],
)
def test_what_is_no_thumbnail_is_refused(tmp_path: Path, content: bytes) -> None:
    from blender_addon.pictures.thumbnail import read_thumbnail

    (tmp_path / "x.ppm").write_bytes(content)
    with pytest.raises(OSError, match="is not a picture"):
        read_thumbnail(tmp_path / "x.ppm")
    with pytest.raises(OSError, match="No such file"):
        read_thumbnail(tmp_path / "y.ppm")


def test_thumbnails_are_those_of_the_backend(tmp_path: Path) -> None:
    """What one side writes the other reads."""
    from blender_addon.pictures.thumbnail import read_thumbnail
    from mfo_backend.report.picture import thumbnail_bytes

    display = np.random.default_rng(1).uniform(0, 1, (30, 50, 3)).astype(np.float32)
    (tmp_path / "x.ppm").write_bytes(thumbnail_bytes(display))
    assert np.abs(read_thumbnail(tmp_path / "x.ppm") / 255.0 - display).max() <= 0.5 / 255.0 + 1e-6


@pytest.mark.parametrize("killed", [False, True])
def test_a_killed_fit_has_the_pictures_that_it_left(
    scene: SimpleNamespace, icons: Collection, monkeypatch: pytest.MonkeyPatch, killed: bool
) -> None:
    """And no button for a picture that it has not written."""
    from blender_addon.panel.compare import Compare
    from blender_addon.result import shown_result

    monkeypatch.setenv("MFO_FAKE", json.dumps({"end": "killed" if killed else ""}))
    with suppress(RuntimeError):
        fit(scene)
    found = shown_result.result
    assert found is not None
    assert found.partial == killed
    context = scene.bpy.context
    panel: Any = SimpleNamespace(layout=Layout(_untranslated()))
    Compare.draw(
        panel,
        SimpleNamespace(
            object=context.object, window_manager=context.window_manager, preferences=context.preferences,
            region=SimpleNamespace(width=280.0),
        ),  # type: ignore[arg-type]  # stands for Blender's
    )  # fmt: skip
    texts = list(_texts(panel.layout))
    texts = texts[: texts.index("Check in Cycles")]
    assert "a picture" in texts
    buttons = {"Result", "Start", "Split"}
    assert buttons.intersection(texts) == (set() if killed else buttons)
    assert ("Preliminary" in texts) == killed


def test_thumbnails_are_loaded_by_a_timer_and_anew_when_their_file_is_written(
    icons: Collection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A panel that is drawn asks the disk nothing: the timer does, some seconds after it has looked last."""
    from blender_addon.panel import thumbnails

    timers: list[Any] = []
    clock, drawn = [100.0], [0]
    app = SimpleNamespace(
        background=False,
        timers=SimpleNamespace(is_registered=timers.__contains__, register=lambda f, first_interval: timers.append(f)),
    )
    monkeypatch.setattr(thumbnails, "bpy", SimpleNamespace(app=app))
    monkeypatch.setattr(thumbnails, "redraw", lambda: drawn.__setitem__(0, drawn[0] + 1))
    monkeypatch.setattr(thumbnails, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    path = tmp_path / "thumbnails" / "result.ppm"

    def draw() -> int:
        with monkeypatch.context() as disk:
            for name in ("stat", "open", "exists", "is_file"):
                disk.setattr(Path, name, lambda *_, **__: pytest.fail("a panel that is drawn asked the disk"))
            return thumbnails.thumbnail(path)

    def later() -> int:
        """What is drawn once the timer has looked again, for which it is called once."""
        clock[0] += thumbnails.LASTS + 0.1
        draw()
        assert timers.pop()() is None
        return draw()

    assert later() == 0
    assert (timers, drawn) == ([], [0])  # there is none, which is no news
    fake_backend.thumbnail(tmp_path, "result", (200, 60, 40))
    first = later()
    assert (first > 0, drawn) == (True, [1])
    assert (later(), drawn) == (first, [1])
    path.write_bytes(b"P6 4 2 255\n" + bytes(24))
    second = later()
    assert second not in (0, first)
    previews_cleared(monkeypatch)
    assert draw() == 0
    assert later() > 0
    path.write_bytes(b"no picture")
    assert later() == 0
    path.unlink()
    assert later() == 0
    thumbnails.close()


def previews_cleared(monkeypatch: pytest.MonkeyPatch) -> None:
    """As when another fit begins."""
    from blender_addon.pictures import previews

    monkeypatch.setattr(previews, "_shown", {})


@pytest.mark.parametrize("shows", [False, True])
@pytest.mark.parametrize("size", [(1920, 1080), (256, 256)])
def test_the_difference_of_a_running_fit_takes_the_place_of_the_reference(
    scene: SimpleNamespace, icons: Collection, tmp_path: Path, size: tuple[int, int], shows: bool
) -> None:
    """Where two pictures share a square; else all three are there."""
    from blender_addon.panel import run

    shown(("reference", "current", "difference"), tmp_path, size)
    context = scene.bpy.context
    state = context.window_manager.mfo_runtime
    state.material, state.progress_text, state.shows_difference = "Glaze", "Refining · 50%", shows
    layout = Layout(_untranslated())
    narrow = SimpleNamespace(
        object=context.object, window_manager=context.window_manager, preferences=context.preferences,
        region=SimpleNamespace(width=280.0),
    )  # fmt: skip
    run._draw_progress(layout, narrow)  # type: ignore[arg-type]  # stand for Blender's
    texts = [
        text
        for text in _texts(layout)
        if text in {"Reference", "Preliminary", "Difference", "Goal", "Current", "Error"}
    ]
    if size[0] == size[1]:
        assert len(texts) == 3
    else:
        assert texts == [*(("Difference", "Preliminary") if shows else ("Reference", "Preliminary")), "Difference"]
