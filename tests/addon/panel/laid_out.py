# SPDX-License-Identifier: Apache-2.0
"""A panel's layout as Blender makes it, as far as widths go: which texts it would cut at a width of the region.

The shares follow Blender's own rules: an item of a row asks for ten units, an icon alone for one and no more, a row for
the sum of its items, a column for the widest. What a text has of its share was measured in windows of Blender 5.2:
texts of rising width in every kind of item, and the last that was drawn uncut.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

UNIT = 20.0  # of all that follows: pixels at a scale of 1, an icon's width
ASKED = 10 * UNIT  # by an item with a text, where the layout expands
GAP = 8.0  # between items of a row or a split that are not aligned
BESIDE = 7.0  # beside a bar in a column of values: 47 pixels were drawn where 54 were its share
LABEL = 3.0  # margins of a label
BOX = 16.0  # a box's margins
AROUND = 52.0  # a panel's margins and the tabs of the sidebar
LIST = 26.0  # margins and bar of a list
HEADER = 28.0  # the arrow of a panel's header
SUB_HEADER = 12.0  # how much further in a sub-panel's header begins
ICON = 25.0  # before a text
BUTTON = 5.0  # margins of a button's text
NUMBER = 40.0  # margins and arrows of a number with its name
LONE_NUMBER = 26.0  # the same without a name
MENU = 28.0  # margin and arrow of a menu
NAME_SHARE = 0.4  # of a property's name where names and values are split


@dataclass(frozen=True)
class Cut:
    """A text, its width and the room it has, in pixels at a scale of 1."""

    text: str
    width: float
    room: float


@dataclass(frozen=True)
class Item:
    """One text, the margins that its kind takes, and what it asks for in a row."""

    texts: tuple[str, ...]
    margins: float
    asked: float = ASKED
    fixed: bool = False

    def cut(self, width: float, measure: Any) -> Iterator[Cut]:
        """The texts that do not fit a width."""
        for text in self.texts:
            if measure(text) > width - self.margins:
                yield Cut(text, measure(text), width - self.margins)


@dataclass(frozen=True)
class Picture(Item):
    """An icon as a picture; Blender draws it into a square."""

    icon: int = 0
    side: float = 0.0


class Layout:
    """Stands for a UILayout: keeps what is drawn, with its place; `words` translates as Blender would."""

    def __init__(self, words: Any, kind: str = "column", *, align: bool = False, factor: float = 0.0) -> None:
        self.words, self.kind, self.align, self.factor = words, kind, align, factor
        self.alignment, self.use_property_split, self.fixed = "EXPAND", False, False
        self.in_split = False
        self.items: list[Any] = []

    def _within(self, kind: str, **options: Any) -> Layout:
        made = Layout(self.words, kind, **options)
        made.use_property_split, made.in_split = self.use_property_split, self.kind == "split"
        self.items.append(made)
        return made

    def row(self, *, align: bool = False) -> Layout:
        return self._within("row", align=align)

    def column(self, *, align: bool = False) -> Layout:
        return self._within("column", align=align)

    def split(self, *, factor: float = 0.0, align: bool = False) -> Layout:
        return self._within("split", factor=factor, align=align)

    def box(self) -> Layout:
        return self._within("box")

    def panel(self, _name: str, **_options: Any) -> tuple[Layout, Layout]:
        return self._within("header"), self._within("column")

    def separator(self) -> None:
        pass

    def template_icon(self, *, icon_value: int, scale: float) -> None:
        self.items.append(Picture((), 0.0, icon=icon_value, side=scale * UNIT))

    def template_ID(self, *_given: Any, **_options: Any) -> None:
        self.items.append(Item((), 0.0))

    def template_list(self, kind: str, _id: str, data: Any, name: str, active: Any, index: str, rows: int) -> None:
        import bpy

        within = self._within("list")
        for item in getattr(data, name):
            row = within.row()
            getattr(bpy.types, kind).draw_item(SimpleNamespace(), self.words.context, row, data, item, 0, active, index)

    def label(self, *, text: str = "", icon: str = "NONE", icon_value: int = 0, translate: bool = True) -> None:
        self._text(text, "*", icon != "NONE" or icon_value > 0, LABEL, translate)

    def progress(self, *, text: str, **_options: Any) -> None:
        self._text(text, "*", False, BUTTON + BESIDE if self.in_split else BUTTON, False)

    def operator(
        self, name: str, *, text: str | None = None, icon: str = "NONE", translate: bool = True, **_options: Any
    ) -> Any:
        import bpy

        if text is None:
            space, what = name.split(".")
            text = getattr(bpy.types, f"{space.upper()}_OT_{what}").bl_label
        self._text(text, "Operator", icon != "NONE", BUTTON, translate)
        return SimpleNamespace()

    def prop_enum(self, data: Any, name: str, value: str, *, text: str, icon: str = "NONE") -> None:
        self._text(text, "*", icon != "NONE", BUTTON, True)

    def prop(
        self,
        data: Any,
        name: str,
        *,
        text: str | None = None,
        icon: str = "NONE",
        translate: bool = True,
        expand: bool = False,
        index: int = -1,
        **_options: Any,
    ) -> None:
        property = data.bl_rna.properties[name]
        text = property.name if text is None else text
        shown = self.words(text, "*") if translate else text
        names = tuple(self.words(item.name, "*") for item in getattr(property, "enum_items", ()))
        if expand:
            self.items += [Item((each,), BUTTON) for each in names]
            return
        named = self._within("split", factor=NAME_SHARE, align=True) if self.use_property_split else self
        if property.type == "BOOLEAN":
            if named is not self:
                named.items.append(Item((), 0.0))
            named.items.append(Item((shown,), ICON))
            return
        if named is not self:
            named.items.append(Item((shown,), BUTTON))
            shown = ""
        if property.type == "ENUM":
            named.items.append(Item(names, MENU))
        elif property.type in {"INT", "FLOAT"} and not property.is_array:
            number = _number(data, property)
            named.items.append(Item((f"{shown} {number}",), NUMBER) if shown else Item((number,), LONE_NUMBER))
        else:
            named.items.append(Item((), 0.0))  # what is written in a field is not the panel's

    def _text(self, text: str, context: str, icon: bool, margins: float, translate: bool) -> None:
        shown = self.words(text, context) if translate else text
        margins = ICON if icon else margins
        if icon and not text:
            self.items.append(Item((), 0.0, UNIT, fixed=True))
            return
        if self.alignment == "EXPAND":
            self.items.append(Item((shown,), margins))
        else:
            self.items.append(Item((shown,), margins, self.words.measure(shown) + margins + BUTTON, fixed=True))

    @property
    def asked(self) -> float:
        """How wide it would like to be."""
        wished = [item.asked for item in self.items] or [0.0]
        if self.kind == "row":
            return sum(wished) + self._gap * (len(wished) - 1)
        return max(wished) + (BOX if self.kind == "box" else 0.0)

    @property
    def _gap(self) -> float:
        return 0.0 if self.align else GAP

    def cut(self, width: float, measure: Any) -> Iterator[Cut]:
        """The texts within that do not fit a width."""
        for item, share in zip(self.items, self._shares(width), strict=True):
            yield from item.cut(share, measure)

    def pictures(self, width: float) -> Iterator[tuple[Picture, float]]:
        """The pictures within, each with the width it has."""
        for item, share in zip(self.items, self._shares(width), strict=True):
            if isinstance(item, Layout):
                yield from item.pictures(share)
            elif isinstance(item, Picture):
                yield item, share

    def _shares(self, width: float) -> list[float]:
        count = len(self.items)
        if self.kind not in {"row", "split"} or not count:
            inner = width - {"box": BOX, "list": LIST, "header": HEADER}.get(self.kind, 0.0)
            return [inner] * count
        room = width - self._gap * (count - 1)
        if self.kind == "split":
            first = self.factor or 1.0 / count
            others = (1.0 - first) * room / max(count - 1, 1)
            return [first * room, *([others] * (count - 1))]
        held = [item.fixed for item in self.items]
        if all(held):
            wished = sum(item.asked for item in self.items)
            return [item.asked * min(1.0, room / wished) for item in self.items]
        rest = room - sum(item.asked for item in self.items if item.fixed)
        wished = sum(item.asked for item in self.items if not item.fixed)
        return [item.asked if item.fixed else rest * item.asked / wished for item in self.items]


def _number(data: Any, property: Any) -> str:
    """As it would be shown."""
    value = getattr(data, property.identifier)
    if property.type == "INT":
        return str(value)
    return f"{value:.1f}%" if property.subtype == "PERCENTAGE" else f"{value:.3f}"
